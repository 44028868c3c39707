#include "engine/model/assimp_library.h"

#include <assimp/cfileio.h>
#include <assimp/cimport.h>
#include <assimp/config.h>
#include <assimp/postprocess.h>
#include <dlfcn.h>
#include <fmt/format.h>

#include <algorithm>
#include <cstring>

#include "engine/settings/settings.h"

namespace graze {

struct AssimpLibrary::Functions {
  decltype(&aiImportFileExWithProperties) import_file;
  decltype(&aiApplyPostProcessing) process;
  decltype(&aiGetErrorString) error_string;
  decltype(&aiIsExtensionSupported) is_supported;
  decltype(&aiCreatePropertyStore) create_properties;
  decltype(&aiSetImportPropertyInteger) set_property;
};

namespace {

// A file in memory, as C's functions see it.
struct BytesAsFile {
  aiFile file;
  const char* bytes;
  std::size_t size, at;
};

BytesAsFile& of(aiFile* file) { return *reinterpret_cast<BytesAsFile*>(file->UserData); }

std::size_t read_bytes(aiFile* file, char* to, std::size_t size, std::size_t count) {
  BytesAsFile& from = of(file);
  if (size == 0) return 0;
  const std::size_t whole = std::min(count, (from.size - from.at) / size);
  if (whole > 0) std::memcpy(to, from.bytes + from.at, whole * size);
  from.at += whole * size;
  return whole;
}

aiReturn seek(aiFile* file, std::size_t offset, aiOrigin origin) {
  BytesAsFile& from = of(file);
  const std::size_t base = origin == aiOrigin_SET ? 0 : origin == aiOrigin_CUR ? from.at : from.size;
  // From the end backwards, as memory is read elsewhere in that library.
  if (origin == aiOrigin_END ? offset > from.size : offset > from.size - base) return aiReturn_FAILURE;
  from.at = origin == aiOrigin_END ? from.size - offset : base + offset;
  return aiReturn_SUCCESS;
}

/// A mesh is one file: what it says of others (materials) is not looked at.
struct OneFile {
  aiFileIO io;
  const std::string* name;
  const std::string* bytes;
};

aiFile* open_only_it(aiFileIO* io, const char* name, const char*) {
  const OneFile& one = *reinterpret_cast<OneFile*>(io->UserData);
  if (*one.name != name) return nullptr;
  auto* const opened = new BytesAsFile{{}, one.bytes->data(), one.bytes->size(), 0};
  opened->file = {read_bytes,
                  [](aiFile*, const char*, std::size_t, std::size_t) { return std::size_t{0}; },
                  [](aiFile* file) { return of(file).at; },
                  [](aiFile* file) { return of(file).size; },
                  seek,
                  [](aiFile*) {},
                  reinterpret_cast<aiUserData>(opened)};
  return &opened->file;
}

void close(aiFileIO*, aiFile* file) { delete &of(file); }

template <class Function>
void find(void* library, const char* name, Function*& out) {
  out = reinterpret_cast<Function*>(dlsym(library, name));
  if (!out) throw MachineError(fmt::format("{} has no function '{}'; is it Assimp 5?", GRAZE_ASSIMP, name));
}

}  // namespace

AssimpLibrary::AssimpLibrary() {
  void* library = dlopen(GRAZE_ASSIMP, RTLD_NOW | RTLD_LOCAL);
  if (!library) {
    throw MachineError(
        fmt::format("{}, which reads meshes, cannot be loaded: {}; install Assimp 5 (of Debian: "
                    "apt-get install libassimp5)",
                    GRAZE_ASSIMP, dlerror()));
  }
  static Functions functions;
  find(library, "aiImportFileExWithProperties", functions.import_file);
  find(library, "aiApplyPostProcessing", functions.process);
  find(library, "aiGetErrorString", functions.error_string);
  find(library, "aiIsExtensionSupported", functions.is_supported);
  find(library, "aiCreatePropertyStore", functions.create_properties);
  find(library, "aiSetImportPropertyInteger", functions.set_property);
  functions_ = &functions;
}

const AssimpLibrary& AssimpLibrary::get() {
  static const AssimpLibrary library;
  return library;
}

bool AssimpLibrary::reads(const std::string& kind) const { return functions_->is_supported(kind.c_str()) == AI_TRUE; }

const aiScene* AssimpLibrary::read(const std::string& name, const std::string& bytes, std::string& said) const {
  aiPropertyStore* properties = functions_->create_properties();
  // As ROS takes them: units count, and which axis a drawing calls "up" does not.
  functions_->set_property(properties, AI_CONFIG_IMPORT_COLLADA_IGNORE_UP_DIRECTION, 1);
  functions_->set_property(properties, AI_CONFIG_IMPORT_NO_SKELETON_MESHES, 1);  // which stand in for missing shapes
  OneFile one{{open_only_it, close, nullptr}, &name, &bytes};
  one.io.UserData = reinterpret_cast<aiUserData>(&one);
  const aiScene* scene = functions_->import_file(name.c_str(), 0, &one.io, properties);
  if (!scene) said = functions_->error_string();
  return scene;
}

const aiScene* AssimpLibrary::triangulate(const aiScene& scene, std::string& said) const {
  const aiScene* out = functions_->process(&scene, aiProcess_Triangulate);
  if (!out) said = functions_->error_string();
  return out;
}

}  // namespace graze
