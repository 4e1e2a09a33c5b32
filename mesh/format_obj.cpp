// Wavefront OBJ: only `v` and `f` matter for a surface.

#include <charconv>

#include "core/error.h"
#include "mesh/mesh_format.h"

namespace scarp {

namespace {

/// The vertex of a corner "v", "v/t", "v//n" or "v/t/n". Counts from 1; negative: from the last.
std::int64_t corner(const WordReader& reader, std::string_view word, std::size_t vertex_count) {
  const std::int64_t index = reader.integer(word.substr(0, word.find('/')));
  if (index == 0) reader.fail("corner 0 of a face; vertices count from 1");
  return index > 0 ? index - 1 : static_cast<std::int64_t>(vertex_count) + index;
}

void append_number(std::string& text, float value) {
  char digits[32];
  const auto result = std::to_chars(digits, digits + sizeof(digits), value);
  text.append(digits, result.ptr);
}

}  // namespace

RawMesh read_obj(const MeshText& text) {
  RawMesh mesh;
  WordReader reader(text);
  std::vector<std::int64_t> polygon;
  std::int64_t highest = -1;
  std::size_t highest_line = 0;
  while (reader.next_line()) {
    const std::string_view keyword = reader.word();
    if (keyword == "v") {
      const float x = reader.coordinate(reader.word());
      const float y = reader.coordinate(reader.word());
      const float z = reader.coordinate(reader.word());
      mesh.vertices.push_back({x, y, z});
    } else if (keyword == "f") {
      polygon.clear();
      for (std::string_view word = reader.word(); !word.empty() && word.front() != '#';
           word = reader.word()) {
        polygon.push_back(corner(reader, word, mesh.vertices.size()));
        if (polygon.back() < 0) reader.fail("a corner counts back beyond the first vertex");
        if (polygon.back() > highest) {
          highest = polygon.back();
          highest_line = reader.line();
        }
      }
      if (polygon.size() < 3) reader.fail("a face needs three corners (does the file end early?)");
      mesh.add_polygon(polygon);
    }
  }
  // Only now, because a face may stand before its vertices.
  if (highest >= static_cast<std::int64_t>(mesh.vertices.size())) {
    throw InputError(text.name + ":" + std::to_string(highest_line) + ": corner " +
                     std::to_string(highest + 1) + " is not among the " +
                     std::to_string(mesh.vertices.size()) +
                     " vertices of the file (does the file end early?)");
  }
  return mesh;
}

std::string obj_text(const TriMesh& mesh) {
  std::string text;
  text.reserve(40 * mesh.vertices.size() + 24 * mesh.triangles.size());
  for (const Vec3f& r : mesh.vertices) {
    text += "v ";
    append_number(text, r.x);
    text += ' ';
    append_number(text, r.y);
    text += ' ';
    append_number(text, r.z);
    text += '\n';
  }
  for (const Triangle& t : mesh.triangles) {
    text += 'f';
    for (const std::uint32_t v : t) text += ' ' + std::to_string(v + 1);
    text += '\n';
  }
  return text;
}

}  // namespace scarp
