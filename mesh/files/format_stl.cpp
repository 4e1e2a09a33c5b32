// STL, text or binary: three corners per facet, no shared vertices.

#include <array>
#include <bit>
#include <cstring>
#include <unordered_map>

#include "core/error.h"
#include "mesh/files/mesh_format.h"

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

std::string lower_case(std::string_view text) {
  std::string result(text);
  for (char& c : result) {
    if (c >= 'A' && c <= 'Z') c = static_cast<char>(c - 'A' + 'a');
  }
  return result;
}

bool is_whole_binary(std::string_view content) {
  return content.size() >= header_bytes &&
         content.size() == header_bytes + facet_bytes * stated_count(content);
}

/// Binary files may start with "solid" as well: the size decides first. Text may start with
/// anything, but a binary file has zeros: in the number of its facets, and between any two of them.
bool is_text(std::string_view content) {
  if (is_whole_binary(content)) return false;
  const std::string start = lower_case(content.substr(0, 1000));
  return start.find('\0') == std::string::npos &&
         (start.find("solid") != std::string::npos || start.find("facet") != std::string::npos);
}

/// Two bytes behind each facet, which some programs use for colours.
bool has_attributes(std::string_view content, std::uint32_t count) {
  for (std::uint32_t f = 0; f < count; ++f) {
    const char* end = content.data() + header_bytes + facet_bytes * (std::size_t{f} + 1);
    if (end[-1] != 0 || end[-2] != 0) return true;
  }
  return false;
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
  if (has_attributes(content, count)) mesh.data_left_out.emplace_back("attributes of facets");
  const std::size_t end = header_bytes + facet_bytes * count;
  if (content.size() > end) {
    mesh.left_out.push_back(counted(content.size() - end, "byte") + " behind the " +
                            std::to_string(count) + " facets that the file states");
  }
  return mesh;
}

class TextReader {
 public:
  explicit TextReader(const MeshText& text) : reader_(text), joiner_(mesh_) {}

  RawMesh read() {
    while (reader_.next_line()) read_line(lower_case(reader_.word()));
    if (inside_) reader_.fail("the file ends within a facet");
    if (!complete_) {
      reader_.fail("the file ends without \"endsolid\": it is cut off; write or copy it again");
    }
    return std::move(mesh_);
  }

 private:
  void read_line(const std::string& keyword) {
    if (keyword.empty()) return;
    if (keyword == "solid") {
      begun_ = true;
      complete_ = false;
    } else if (keyword == "endsolid") {
      complete_ = true;
    } else if (keyword == "facet") {
      if (inside_) reader_.fail("a facet begins within a facet");
      begun_ = inside_ = true;
      complete_ = false;
      facet_.clear();
    } else if (keyword == "vertex") {
      const float x = reader_.coordinate(reader_.word());
      const float y = reader_.coordinate(reader_.word());
      const float z = reader_.coordinate(reader_.word());
      facet_.push_back(joiner_.vertex({x, y, z}));
    } else if (keyword == "endfacet") {
      if (facet_.size() != 3) {
        reader_.fail("a facet has " + std::to_string(facet_.size()) + " corners; STL wants three");
      }
      mesh_.triangles.push_back({facet_[0], facet_[1], facet_[2]});
      inside_ = false;
    } else if (keyword != "outer" && keyword != "endloop" && begun_) {
      // In front of the first solid anything may stand.
      reader_.fail(in_quotes(keyword) + " is no word of STL");
    }
  }

  WordReader reader_;
  RawMesh mesh_;
  VertexJoiner joiner_;
  std::vector<std::uint32_t> facet_;
  bool begun_ = false;
  bool inside_ = false;
  bool complete_ = false;
};

}  // namespace

RawMesh read_stl(const MeshText& text) {
  if (is_whole_binary(text.content)) return read_binary(text);
  const MeshText unmarked = without_mark(text);
  if (!is_text(text.content)) return read_binary(text);
  return TextReader(unmarked).read();
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
