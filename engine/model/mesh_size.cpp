#include "engine/model/mesh_size.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <sstream>
#include <string_view>

#include "engine/model/limits.h"
#include "engine/model/mesh_text.h"
#include "engine/settings/settings.h"

namespace graze {

namespace {

constexpr std::string_view kSpace = " \t\r";

std::size_t count_words(std::string_view line) {
  std::size_t words = 0;
  for (std::size_t at = line.find_first_not_of(kSpace); at != std::string_view::npos;) {
    ++words;
    at = line.find_first_of(kSpace, at);
    if (at != std::string_view::npos) at = line.find_first_not_of(kSpace, at);
  }
  return words;
}

/// Counts what the lines of an OBJ file make.
class ObjCount {
 public:
  explicit ObjCount(const std::string& file) : file_(file) {}

  void run(std::string_view text) {
    std::size_t corners = 0;  // of the face whose lines are being continued by a backslash
    bool continued = false;
    for (int number = 1; !text.empty(); ++number) {
      const std::size_t end = std::min(text.find('\n'), text.size());
      std::string_view line = text.substr(0, end);
      text.remove_prefix(std::min(end + 1, text.size()));
      line.remove_prefix(std::min(line.find_first_not_of(kSpace), line.size()));
      const std::size_t last = line.find_last_not_of(kSpace);
      const bool goes_on = last != std::string_view::npos && line[last] == '\\';
      const char kind = line.empty() ? '#' : line[0];
      const bool element = kind == 'f' || kind == 'l' || kind == 'p';
      if (continued || element) {
        corners += count_words(line);
        take_face(corners, count_words(line), number);
        if (const std::string_view large = large_index(line); !large.empty()) {
          fail(number, fmt::format("no mesh has an index of {}", clipped(large, 20)));
        }
      } else if (kind == 'v') {
        add(corners_, 1, kMaxMeshCorners, number, "vertices and corners of faces");
        if (line.size() < 2 || kSpace.find(line[1]) != std::string_view::npos) {
          if (const std::string problem = vertex_problem(line.substr(1)); !problem.empty())
            fail(number, "v: " + problem);
        }
      } else if (kind != '#') {
        add(parts_, 1, kMaxMeshParts, number, "parts (objects, groups, materials)");
      }
      continued = (continued || element) && goes_on;
      if (!continued) corners = 0;
    }
  }

 private:
  [[noreturn]] void fail(int line, const std::string& message) const {
    throw InputError(fmt::format("{}:{}: {}", file_, line, message));
  }

  void add(std::size_t& sum, std::size_t more, std::size_t most, int line, const char* what) const {
    if ((sum += more) > most) fail(line, fmt::format("more than {} {}; simplify the mesh", most, what));
  }

  void take_face(std::size_t corners, std::size_t more, int line) {
    add(corners_, more, kMaxMeshCorners, line, "vertices and corners of faces");
    if (corners > kMaxPolygon + 1) {  // and the letter
      fail(line, fmt::format("a face of more than {} corners; cut it into triangles", kMaxPolygon));
    }
  }

  const std::string& file_;
  std::size_t corners_ = 0, parts_ = 0;
};

/// Each `solid` of a text file becomes a part.
void check_stl_parts(const std::string& bytes, const std::string& file) {
  constexpr std::string_view kWord = "solid";
  std::size_t parts = 0;
  for (auto at = bytes.begin(); at != bytes.end(); ++at) {
    at = std::search(at, bytes.end(), kWord.begin(), kWord.end(),
                     [](char a, char b) { return std::tolower(static_cast<unsigned char>(a)) == b; });
    if (at == bytes.end()) return;
    if (++parts > 2 * kMaxMeshParts) {  // each ends with `endsolid`
      throw InputError(fmt::format("{}: more than {} solids; simplify the mesh", file, kMaxMeshParts));
    }
  }
}

}  // namespace

std::string_view large_index(std::string_view text) {
  constexpr std::size_t kDigits = 9;  // ten may be more than 32 bits hold
  std::size_t begin = 0;
  for (std::size_t i = 0; i <= text.size(); ++i) {
    if (i < text.size() && text[i] >= '0' && text[i] <= '9') continue;
    if (i - begin > kDigits) return text.substr(begin, i - begin);
    begin = i + 1;
  }
  return {};
}

double largest_coordinate(const Shape& mesh) {
  double most = 0;
  for (const Vec3& vertex : mesh.mesh->vertices) {
    most = std::max(most, vertex.cwiseProduct(mesh.size).cwiseAbs().maxCoeff());
  }
  return most;
}

namespace {

/// Where the line that ends the head of a PLY file begins.
std::size_t end_of_ply_head(const std::string& bytes) {
  constexpr std::string_view kEnd = "end_header";
  for (std::size_t at = bytes.find(kEnd); at != std::string::npos; at = bytes.find(kEnd, at + 1)) {
    const std::size_t behind = at + kEnd.size();
    const bool begins = at > 0 && (bytes[at - 1] == '\n' || bytes[at - 1] == '\r');
    if (begins && behind < bytes.size() && std::string_view(" \t\r\n").find(bytes[behind]) != std::string_view::npos) {
      return at;
    }
  }
  return std::string::npos;
}

}  // namespace

void check_ply_head(const std::string& bytes, const std::string& file) {
  const std::size_t end = end_of_ply_head(bytes);
  if (end == std::string::npos) {
    throw InputError(fmt::format("{}: the head of a PLY file ends with a line 'end_header', and there is none", file));
  }
  // The library makes room for as many elements as the head claims, before it looks whether they are there.
  std::istringstream head(bytes.substr(0, end));
  int number = 0;
  for (std::string line; std::getline(head, line);) {
    ++number;
    std::istringstream words(line);
    std::string word, kind;
    double count = 0;
    if (!(words >> word >> kind >> count) || word != "element") continue;
    // A byte each at least, or a digit and a space.
    if (count <= std::min(static_cast<double>(kMaxMeshCorners), static_cast<double>(bytes.size()))) continue;
    throw InputError(fmt::format("{}:{}: element {}: {:.0f} of them; a mesh has at most {}, and the file has {} bytes",
                                 file, number, clipped(kind, 20), count, kMaxMeshCorners, bytes.size()));
  }
  check_ply_faces(bytes, file);
}

void check_mesh_size(const std::string& bytes, const std::string& file) {
  const bool obj = !file.empty() && std::tolower(static_cast<unsigned char>(file.back())) == 'j';
  if (obj) {
    ObjCount(file).run(bytes);
  } else if (!is_binary_stl(bytes)) {
    check_stl_parts(bytes, file);
    check_stl(bytes, file);
  }
}

}  // namespace graze
