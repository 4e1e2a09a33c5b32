// STL, text or binary: three corners per facet, no shared vertices.

#include <array>
#include <bit>
#include <cstring>
#include <unordered_map>

#include "core/error.h"
#include "mesh/mesh_format.h"

namespace scarp {

namespace {

constexpr std::size_t header_bytes = 84;
constexpr std::size_t facet_bytes = 50;

/// Makes one vertex of corners with the same coordinates.
class VertexJoiner {
 public:
  explicit VertexJoiner(RawMesh& mesh) : mesh_(mesh) {}

  std::uint32_t vertex(Vec3f r) {
    // Adding zero turns -0 into +0, so that both are one place.
    const Key key{std::bit_cast<std::uint32_t>(r.x + 0.0F),
                  std::bit_cast<std::uint32_t>(r.y + 0.0F),
                  std::bit_cast<std::uint32_t>(r.z + 0.0F)};
    const auto [place, is_new] =
        vertices_.try_emplace(key, static_cast<std::uint32_t>(mesh_.vertices.size()));
    if (is_new) mesh_.vertices.push_back(r);
    return place->second;
  }

 private:
  using Key = std::array<std::uint32_t, 3>;
  struct Hash {
    std::size_t operator()(const Key& key) const {
      std::uint64_t hash = 0;
      for (const std::uint32_t part : key) {
        hash = (hash ^ part) * 0x9e3779b97f4a7c15U;
        hash ^= hash >> 32;
      }
      return hash;
    }
  };
  RawMesh& mesh_;
  std::unordered_map<Key, std::uint32_t, Hash> vertices_;
};

std::uint32_t stated_count(std::string_view content) {
  std::uint32_t count = 0;
  std::memcpy(&count, content.data() + header_bytes - sizeof(count), sizeof(count));
  return count;
}

/// Binary files may start with "solid" as well: the size decides first.
bool is_text(std::string_view content) {
  if (content.size() >= header_bytes &&
      content.size() == header_bytes + facet_bytes * stated_count(content)) {
    return false;
  }
  return content.substr(0, 5) == "solid" &&
         content.substr(0, 1000).find_first_of('\0') == std::string_view::npos;
}

RawMesh read_binary(const MeshText& text) {
  const std::string_view content = text.content;
  if (content.size() < header_bytes) {
    throw InputError(text.name + ": ends within the header of a binary STL file");
  }
  const std::uint32_t count = stated_count(content);
  if (content.size() < header_bytes + facet_bytes * count) {
    throw InputError(text.name + ": ends after " +
                     std::to_string((content.size() - header_bytes) / facet_bytes) + " of " +
                     std::to_string(count) + " facets");
  }
  RawMesh mesh;
  VertexJoiner joiner(mesh);
  for (std::uint32_t f = 0; f < count; ++f) {
    std::array<Vec3f, 3> corners;
    std::memcpy(corners.data(), content.data() + header_bytes + facet_bytes * f + 12, 36);
    mesh.triangles.push_back(
        {joiner.vertex(corners[0]), joiner.vertex(corners[1]), joiner.vertex(corners[2])});
  }
  return mesh;
}

RawMesh read_text(const MeshText& text) {
  RawMesh mesh;
  VertexJoiner joiner(mesh);
  WordReader reader(text);
  std::vector<std::uint32_t> facet;
  bool inside = false;
  bool complete = false;
  while (reader.next_line()) {
    const std::string_view keyword = reader.word();
    if (keyword == "solid") complete = false;
    if (keyword == "endsolid") complete = true;
    if (keyword == "facet") {
      if (inside) reader.fail("a facet begins within a facet");
      inside = true;
      facet.clear();
    } else if (keyword == "vertex") {
      const float x = reader.coordinate(reader.word());
      const float y = reader.coordinate(reader.word());
      const float z = reader.coordinate(reader.word());
      facet.push_back(joiner.vertex({x, y, z}));
    } else if (keyword == "endfacet") {
      if (facet.size() != 3) {
        reader.fail("a facet has " + std::to_string(facet.size()) + " corners; STL wants three");
      }
      mesh.triangles.push_back({facet[0], facet[1], facet[2]});
      inside = false;
    }
  }
  if (inside) reader.fail("the file ends within a facet");
  if (!complete) {
    reader.fail("the file ends without \"endsolid\": it is cut off; write or copy it again");
  }
  return mesh;
}

}  // namespace

RawMesh read_stl(const MeshText& text) {
  return is_text(text.content) ? read_text(text) : read_binary(text);
}

std::string stl_bytes(const TriMesh& mesh) {
  std::string bytes = "binary STL written by scarp";
  bytes.resize(header_bytes + facet_bytes * mesh.triangles.size());
  const auto count = static_cast<std::uint32_t>(mesh.triangles.size());
  std::memcpy(bytes.data() + header_bytes - sizeof(count), &count, sizeof(count));
  for (std::size_t f = 0; f < mesh.triangles.size(); ++f) {
    const Triangle& t = mesh.triangles[f];
    const std::array<Vec3f, 4> facet{Vec3f(normalized(area_vector(mesh, f))), mesh.vertices[t[0]],
                                     mesh.vertices[t[1]], mesh.vertices[t[2]]};
    std::memcpy(bytes.data() + header_bytes + facet_bytes * f, facet.data(), sizeof(facet));
  }
  return bytes;
}

}  // namespace scarp
