#include "engine/library/shared_object.h"

#include <dlfcn.h>
#include <elf.h>
#include <fmt/format.h>

#include <cfenv>
#include <cmath>
#include <cstddef>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <stdexcept>
#include <vector>

#include "engine/library/one_line.h"

namespace graze {

namespace {

std::string missing_functions(const GrazePolicy& table) {
  const std::vector<std::pair<const char*, bool>> needed = {{"create", table.create != nullptr},
                                                            {"start", table.start != nullptr},
                                                            {"act", table.act != nullptr},
                                                            {"destroy", table.destroy != nullptr}};
  std::string out;
  for (const auto& [name, there] : needed) {
    if (!there) out += (out.empty() ? "" : ", ") + std::string(name);
  }
  return out;
}

/// What the loader does not tell: a library of another processor is to it as one that is not there.
std::string processor_hint(const std::string& file) {
  Elf64_Ehdr theirs{}, ours{};
  const auto read = [](const std::string& name, Elf64_Ehdr& header) {
    std::ifstream in(name, std::ios::binary);
    return in.read(reinterpret_cast<char*>(&header), sizeof header) &&
           std::memcmp(header.e_ident, ELFMAG, SELFMAG) == 0;
  };
  if (!read(file, theirs) || !read("/proc/self/exe", ours)) return "";
  if (theirs.e_machine == ours.e_machine && theirs.e_ident[EI_CLASS] == ours.e_ident[EI_CLASS]) return "";
  const auto name = [](unsigned machine) -> std::string {
    switch (machine) {
      case EM_X86_64:
        return "x86-64";
      case EM_386:
        return "32-bit x86";
      case EM_AARCH64:
        return "64-bit ARM";
      case EM_ARM:
        return "32-bit ARM";
      case EM_RISCV:
        return "RISC-V";
      default:
        return fmt::format("another processor (ELF machine {})", machine);
    }
  };
  return fmt::format("it is made for {}, and this program for {}: compile it for this machine", name(theirs.e_machine),
                     name(ours.e_machine));
}

/// What somebody meant who gives the source.
std::string source_hint(const std::string& file) {
  const std::filesystem::path source(file);
  const std::string ending = source.extension().string();
  if (ending == ".py") return "; a controller in Python is python: {file: …} instead of library";
  if (ending != ".c" && ending != ".cpp" && ending != ".cc") return "";
  return fmt::format(
      "; it is the source: compile it into a shared object, {0} -O2 -ffp-contract=off -fPIC -shared -I FOLDER -o "
      "{1}.so "
      "{1}{2}, where FOLDER/graze has policy.h, and name that",
      ending == ".c" ? "cc" : "c++", source.stem().string(), ending);
}

}  // namespace

#if defined(__x86_64__)

namespace {
constexpr unsigned kVectorStatus = 0x3f;  // MXCSR: exceptions that have occurred, which no computation heeds

unsigned short stack_control() {
  unsigned short word = 0;
  asm volatile("fnstcw %0" : "=m"(word));
  return word;
}
}  // namespace

SharedObject::FloatingPoint::FloatingPoint()
    : vector_(__builtin_ia32_stmxcsr() & ~kVectorStatus), stack_(stack_control()) {}
bool SharedObject::FloatingPoint::holds() const {
  return (__builtin_ia32_stmxcsr() & ~kVectorStatus) == vector_ && stack_control() == stack_;
}
void SharedObject::FloatingPoint::restore() const {
  __builtin_ia32_ldmxcsr(vector_);
  asm volatile("fldcw %0" : : "m"(stack_));
}

#else

SharedObject::FloatingPoint::FloatingPoint()
    : vector_(static_cast<unsigned>(fegetround())), stack_(static_cast<unsigned short>(fegetexcept())) {}
bool SharedObject::FloatingPoint::holds() const {
  return static_cast<unsigned>(fegetround()) == vector_ && static_cast<unsigned short>(fegetexcept()) == stack_;
}
void SharedObject::FloatingPoint::restore() const {
  fesetenv(FE_DFL_ENV);
  fesetround(static_cast<int>(vector_));
}

#endif

SharedObject::SharedObject(const LibraryUse& use)
    : file_(std::filesystem::path(use.file).filename().string()), timeout_(use.timeout) {
  check_library_file(use);
  const Settings place = use.place.at("file");
  const FloatingPoint before;
  void* symbol = nullptr;
  std::string problem;
  {
    const Shown shown(LibraryCall::load, std::nan(""), file_.c_str(), limit_of(LibraryCall::load));
    void* const handle = dlopen(use.file.c_str(), RTLD_NOW | RTLD_LOCAL | RTLD_NODELETE);
    if (!handle) problem = dlerror();
    if (handle) symbol = dlsym(handle, "graze_policy");
    if (symbol) table_ = reinterpret_cast<const GrazePolicy* (*)()>(symbol)();
  }
  before.restore();  // libraries that were built with -ffast-math flush small numbers from their loading on
  if (problem.empty()) add_loaded_library(file_);
  if (!problem.empty()) {
    const std::string foreign = processor_hint(use.file);
    place.fail(fmt::format("{}: cannot be loaded: {}", use.file,
                           foreign.empty() ? one_line(problem) + source_hint(use.file) : foreign));
  }
  if (!symbol) {
    place.fail(
        fmt::format("{}: has no function graze_policy(); graze/policy.h tells what it returns (in C++ it is "
                    "extern \"C\")",
                    use.file));
  }
  if (!table_) place.fail(fmt::format("{}: graze_policy() returns NULL instead of a table", use.file));
  if (table_->version != GRAZE_POLICY_VERSION) {
    place.fail(
        fmt::format("{}: is made for version {} of graze/policy.h, and this program has version {}; compile it "
                    "anew with this program's header",
                    use.file, table_->version, GRAZE_POLICY_VERSION));
  }
  if (table_->size < sizeof(GrazePolicy)) {
    place.fail(fmt::format("{}: its table has {} bytes and needs {}: write sizeof(GrazePolicy)", use.file, table_->size,
                           sizeof(GrazePolicy)));
  }
  const std::string missing = missing_functions(*table_);
  if (!missing.empty()) place.fail(fmt::format("{}: its table lacks: {}", use.file, missing));
}

double SharedObject::limit_of(LibraryCall which) const {
  return which == LibraryCall::load || which == LibraryCall::create ? timeout_ + kSlowStart : timeout_;
}

void SharedObject::fail(LibraryCall which, double time, const std::string& what) const {
  const std::string when = std::isnan(time) ? "" : fmt::format(" at {:.6g} s", time);
  throw std::runtime_error(fmt::format("{}: {}{} {}", one_line(file_), name_of(which), when, one_line(what)));
}

std::string SharedObject::reason(void* policy) const {
  if (!table_->last_error) return "";
  const char* const text = table_->last_error(policy);
  return text && *text ? ": " + one_line(text) : "";
}

}  // namespace graze
