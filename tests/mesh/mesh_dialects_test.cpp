// One body in every dialect that the readers know.

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstring>
#include <functional>
#include <map>
#include <numbers>
#include <string>

#include "core/random.h"
#include "core/system/base64.h"
#include "core/system/deflate.h"
#include "core/system/temporary_folder.h"
#include "mesh/files/mesh_file.h"

namespace scarp {
namespace {

/// A closed body of bands of triangles, each of them a strip as well.
struct BandedBody {
  TriMesh mesh;
  std::vector<std::vector<std::uint32_t>> strips;
};

BandedBody random_body(std::uint64_t seed) {
  RandomStream random({.seed = seed});
  const auto uniform = [&random] { return random.uniform(); };
  const auto columns = static_cast<std::uint32_t>(3 + 9 * uniform());
  const auto rows = static_cast<std::uint32_t>(2 + 7 * uniform());
  const double scale = std::pow(10.0, 8 * uniform() - 4);
  const Vec3d centre{scale * uniform(), scale * uniform(), -scale * uniform()};
  BandedBody body;
  const auto add = [&](double theta, double phi) {
    const double radius = scale * (0.7 + 0.3 * uniform());
    body.mesh.vertices.push_back(
        Vec3f(centre + radius * Vec3d{std::sin(theta) * std::cos(phi),
                                      std::sin(theta) * std::sin(phi), std::cos(theta)}));
  };
  add(0, 0);
  for (std::uint32_t row = 1; row < rows; ++row) {
    for (std::uint32_t column = 0; column < columns; ++column) {
      add(std::numbers::pi * row / rows, 2 * std::numbers::pi * column / columns);
    }
  }
  add(std::numbers::pi, 0);
  const auto vertex = [&](std::uint32_t row, std::uint32_t column) {
    if (row == 0) return 0U;
    if (row == rows) return (rows - 1) * columns + 1;
    return (row - 1) * columns + column % columns + 1;
  };
  for (std::uint32_t row = 0; row < rows; ++row) {
    // At the poles every second triangle has two equal corners.
    std::vector<std::uint32_t>& strip = body.strips.emplace_back();
    for (std::uint32_t column = 0; column <= columns; ++column) {
      strip.push_back(vertex(row, column));
      strip.push_back(vertex(row + 1, column));
    }
    for (std::size_t i = 0; i + 2 < strip.size(); ++i) {
      Triangle t{strip[i], strip[i + 1], strip[i + 2]};
      if (i % 2 == 1) std::swap(t[0], t[1]);
      if (t[0] != t[1] && t[1] != t[2] && t[2] != t[0]) body.mesh.triangles.push_back(t);
    }
  }
  return body;
}

/// Corners by their coordinates, the least one first, in order: of two files they are the same
/// whatever the numbers of vertices and the order of triangles.
std::vector<std::array<std::array<float, 3>, 3>> facets_of(const TriMesh& mesh) {
  std::vector<std::array<std::array<float, 3>, 3>> facets;
  for (const Triangle& t : mesh.triangles) {
    std::array<std::array<float, 3>, 3> facet{};
    for (std::size_t c = 0; c < 3; ++c) {
      const Vec3f r = mesh.vertices[t[c]];
      facet[c] = {r.x, r.y, r.z};
    }
    std::rotate(facet.begin(), std::min_element(facet.begin(), facet.end()), facet.end());
    facets.push_back(facet);
  }
  std::sort(facets.begin(), facets.end());
  return facets;
}

double volume_of(const TriMesh& mesh) {
  double volume = 0;
  for (std::size_t f = 0; f < mesh.triangles.size(); ++f) {
    volume += dot(corners(mesh, f)[0], area_vector(mesh, f)) / 3;
  }
  return volume;
}

std::string digits(float value) {
  std::array<char, 32> text{};
  std::snprintf(text.data(), text.size(), "%.9g", double{value});
  return text.data();
}

std::string place(Vec3f r) { return digits(r.x) + ' ' + digits(r.y) + ' ' + digits(r.z); }

std::string replaced(std::string text, const std::string& from, const std::string& to) {
  for (std::size_t at = 0; (at = text.find(from, at)) != text.npos; at += to.size()) {
    text.replace(at, from.size(), to);
  }
  return text;
}

std::string upper_case(std::string text) {
  for (char& c : text) c = static_cast<char>(c >= 'a' && c <= 'z' ? c - 'a' + 'A' : c);
  return text;
}

template <class T>
void append(std::string& bytes, T value, bool is_big_endian = false) {
  std::array<char, sizeof(T)> raw;
  std::memcpy(raw.data(), &value, sizeof(T));
  if (is_big_endian) std::reverse(raw.begin(), raw.end());
  bytes.append(raw.data(), raw.size());
}

/// corner(v) as it stands in a face.
std::string obj(const BandedBody& body, const std::function<std::string(std::uint32_t)>& corner,
                const std::string& space = " ") {
  std::string text = "# a body\no body\nvn 0 0 1\nvt 0 0\n";
  for (const Vec3f& r : body.mesh.vertices) text += "v " + place(r) + '\n';
  for (const Triangle& t : body.mesh.triangles) {
    text += "f";
    for (const std::uint32_t v : t) text += space + corner(v);
    text += '\n';
  }
  return text;
}

enum class PlyFaces { triangles, strips };

template <class Coordinate, class Index>
std::string binary_ply(const BandedBody& body, PlyFaces faces, bool is_big_endian,
                       const std::string& types) {
  const TriMesh& mesh = body.mesh;
  const bool has_strips = faces == PlyFaces::strips;
  const std::string coordinate = types.substr(0, types.find(' '));
  const std::string index = types.substr(types.find(' ') + 1);
  std::string bytes = std::string("ply\nformat binary_") + (is_big_endian ? "big" : "little") +
                      "_endian 1.0\nelement vertex " + std::to_string(mesh.vertices.size()) + '\n';
  for (const char* axis : {"x", "y", "z"}) bytes += "property " + coordinate + ' ' + axis + '\n';
  bytes +=
      "property uchar red\nelement " +
      (has_strips ? std::string("tristrips 1") : "face " + std::to_string(mesh.triangles.size())) +
      "\nproperty list int " + index + " vertex_indices\nend_header\n";
  for (const Vec3f& r : mesh.vertices) {
    for (const float x : {r.x, r.y, r.z}) append(bytes, static_cast<Coordinate>(x), is_big_endian);
    append(bytes, std::uint8_t{200});
  }
  if (!has_strips) {
    for (const Triangle& t : mesh.triangles) {
      append(bytes, std::int32_t{3}, is_big_endian);
      for (const std::uint32_t v : t) append(bytes, static_cast<Index>(v), is_big_endian);
    }
    return bytes;
  }
  std::vector<std::int64_t> list;
  for (const auto& strip : body.strips) {
    if (!list.empty()) list.push_back(-1);
    list.insert(list.end(), strip.begin(), strip.end());
  }
  append(bytes, static_cast<std::int32_t>(list.size()), is_big_endian);
  for (const std::int64_t v : list) append(bytes, static_cast<Index>(v), is_big_endian);
  return bytes;
}

std::string text_ply(const BandedBody& body) {
  const TriMesh& mesh = body.mesh;
  std::string text = "ply\nformat ascii 1.0\ncomment text\nelement vertex " +
                     std::to_string(mesh.vertices.size()) +
                     "\nproperty float x\nproperty float y\nproperty float z\nelement face " +
                     std::to_string(mesh.triangles.size()) +
                     "\nproperty list uchar int vertex_index\nend_header\n";
  for (const Vec3f& r : mesh.vertices) text += place(r) + '\n';
  for (const Triangle& t : mesh.triangles) {
    text += '3';
    for (const std::uint32_t v : t) text += ' ' + std::to_string(v);
    text += '\n';
  }
  return text;
}

std::string text_stl(const BandedBody& body, const std::string& name) {
  std::string text = "solid" + name + '\n';
  for (const Triangle& t : body.mesh.triangles) {
    text += "  facet normal 0 0 0\n    outer loop\n";
    for (const std::uint32_t v : t) text += "      vertex " + place(body.mesh.vertices[v]) + '\n';
    text += "    endloop\n  endfacet\n";
  }
  return text + "endsolid" + name + '\n';
}

struct VtpDialect {
  bool is_appended = false;
  bool is_base64 = false;
  bool is_compressed = false;
  bool has_wide_header = false;
  bool has_strips = false;
};

/// Arrays as VTK writes them, with lines and vertices that count as cells before the others.
class Vtp {
 public:
  explicit Vtp(const VtpDialect& dialect) : dialect_(dialect) {}

  std::string text(const BandedBody& body) {
    const TriMesh& mesh = body.mesh;
    std::vector<double> points;
    for (const Vec3f& r : mesh.vertices) {
      for (const float x : {r.x, r.y, r.z}) points.push_back(double{x});
    }
    std::vector<std::int32_t> connectivity;
    std::vector<std::int32_t> offsets;
    const auto add = [&](const auto& cell) {
      for (const std::uint32_t v : cell) connectivity.push_back(static_cast<std::int32_t>(v));
      offsets.push_back(static_cast<std::int32_t>(connectivity.size()));
    };
    if (dialect_.has_strips) {
      for (const auto& strip : body.strips) add(strip);
    } else {
      for (const Triangle& t : mesh.triangles) add(t);
    }
    const std::string count = std::to_string(offsets.size());
    std::string xml = std::string(
                          "<?xml version=\"1.0\"?>\n<VTKFile type=\"PolyData\" "
                          "byte_order=\"LittleEndian\"") +
                      (dialect_.has_wide_header ? " header_type=\"UInt64\"" : "") +
                      (dialect_.is_compressed ? " compressor=\"vtkZLibDataCompressor\"" : "") +
                      ">\n<PolyData><Piece NumberOfPoints=\"" +
                      std::to_string(mesh.vertices.size()) +
                      "\" NumberOfVerts=\"0\" NumberOfLines=\"1\" NumberOfStrips=\"" +
                      (dialect_.has_strips ? count : "0") + "\" NumberOfPolys=\"" +
                      (dialect_.has_strips ? "0" : count) + "\">\n<PointData>" +
                      array<double>("Float64", "T", points) + "</PointData><Points>" +
                      array<double>("Float64", "Points", points, 3) + "</Points>\n<Lines>" +
                      array<std::int32_t>("Int32", "connectivity", {0, 1}) +
                      array<std::int32_t>("Int32", "offsets", {2}) + "</Lines>\n";
    xml += dialect_.has_strips ? "<Strips>" : "<Polys>";
    xml += array<std::int32_t>("Int32", "connectivity", connectivity) +
           array<std::int32_t>("Int32", "offsets", offsets);
    xml += dialect_.has_strips ? "</Strips>" : "</Polys>";
    xml += "</Piece></PolyData>\n";
    if (dialect_.is_appended) {
      xml += std::string("<AppendedData encoding=\"") + (dialect_.is_base64 ? "base64" : "raw") +
             "\">\n  _" + appended_ + "\n</AppendedData>";
    }
    return xml + "</VTKFile>\n";
  }

 private:
  template <class T>
  std::string array(const std::string& type, const std::string& name, const std::vector<T>& values,
                    int components = 1) {
    std::string tag = "<DataArray type=\"" + type + "\" Name=\"" + name +
                      "\" NumberOfComponents=\"" + std::to_string(components) + '"';
    if (!dialect_.is_appended && !dialect_.is_base64) {
      tag += " format=\"ascii\">\n";
      for (const T value : values) tag += digits(static_cast<float>(value)) + ' ';
      return tag + "\n</DataArray>\n";
    }
    const std::string_view raw(reinterpret_cast<const char*>(values.data()),
                               values.size() * sizeof(T));
    if (!dialect_.is_appended) {
      return tag + " format=\"binary\">\n   " + encoded(raw) + "\n</DataArray>\n";
    }
    tag += " format=\"appended\" offset=\"" + std::to_string(appended_.size()) + "\"/>\n";
    appended_ += encoded(raw);
    return tag;
  }

  std::string encoded(std::string_view raw) const {
    std::string head;
    std::string content;
    const auto number = [&](std::size_t value) {
      if (dialect_.has_wide_header) return append(head, std::uint64_t{value});
      append(head, static_cast<std::uint32_t>(value));
    };
    if (dialect_.is_compressed) {
      constexpr std::size_t block = 200;  // so that there are several
      std::vector<std::string> packed;
      for (std::size_t at = 0; at < raw.size(); at += block) {
        packed.push_back(deflated(raw.substr(at, block)));
      }
      number(packed.size());
      number(block);
      number(raw.size() % block);
      for (const std::string& each : packed) {
        number(each.size());
        content += each;
      }
    } else {
      number(raw.size());
      content = raw;
    }
    if (!dialect_.is_base64) return head + content;
    // VTK encodes the head on its own where data are compressed.
    return dialect_.is_compressed ? base64(head) + base64(content) : base64(head + content);
  }

  VtpDialect dialect_;
  std::string appended_;
};

/// By the name of a file.
std::map<std::string, std::string> dialects_of(const BandedBody& body) {
  const auto number = [](std::uint32_t v) { return std::to_string(v + 1); };
  const auto count = static_cast<std::uint32_t>(body.mesh.vertices.size());
  const auto from_the_end = [count](std::uint32_t v) { return '-' + std::to_string(count - v); };
  const std::string plain = obj(body, number);
  const std::string stl = text_stl(body, " a body");
  std::map<std::string, std::string> files{
      {"plain.obj", plain},
      {"negative.obj", obj(body, from_the_end)},
      {"textured.obj", obj(body, [&](std::uint32_t v) { return number(v) + "/1/1"; })},
      {"normals.obj", obj(body, [&](std::uint32_t v) { return number(v) + "//1"; })},
      {"coordinates.obj", obj(body, [&](std::uint32_t v) { return number(v) + "/1"; })},
      {"joined.obj", obj(body, number, " \\\n ")},
      {"joined_crlf.obj", obj(body, number, "\\\r\n\t")},
      {"crlf.obj", replaced(plain, "\n", "\r\n")},
      {"marked.obj", "\xEF\xBB\xBF" + plain},
      {"text.ply", text_ply(body)},
      {"crlf.ply", replaced(text_ply(body), "\n", "\r\n")},
      {"text.stl", stl},
      {"nameless.stl", text_stl(body, "")},
      {"capitals.STL", upper_case(stl)},
      {"marked.stl", "\xEF\xBB\xBF" + stl},
      {"newline.stl", "\n\n" + stl},
      {"spaces.stl", " \t" + stl},
      {"comment.stl", "# by hand\n" + stl},
      {"bare.stl", stl.substr(stl.find('\n') + 1)},
      {"crlf.stl", replaced(stl, "\n", "\r\n")}};
  for (const bool is_big : {false, true}) {
    const std::string end = is_big ? "_big.ply" : "_little.ply";
    for (const PlyFaces faces : {PlyFaces::triangles, PlyFaces::strips}) {
      const std::string kind = faces == PlyFaces::strips ? "strips" : "faces";
      files[kind + "_float_int" + end] =
          binary_ply<float, std::int32_t>(body, faces, is_big, "float int");
      files[kind + "_double_short" + end] =
          binary_ply<double, std::int16_t>(body, faces, is_big, "double short");
    }
  }
  for (int n = 0; n < 32; ++n) {
    const VtpDialect dialect{.is_appended = (n & 1) != 0,
                             .is_base64 = (n & 2) != 0,
                             .is_compressed = (n & 4) != 0,
                             .has_wide_header = (n & 8) != 0,
                             .has_strips = (n & 16) != 0};
    files["dialect_" + std::to_string(n) + ".vtp"] = Vtp(dialect).text(body);
  }
  return files;
}

void run_campaign(std::uint64_t first, std::uint64_t last) {
  for (std::uint64_t seed = first; seed <= last; ++seed) {
    const BandedBody body = random_body(seed);
    const auto facets = facets_of(body.mesh);
    const double volume = volume_of(body.mesh);
    ASSERT_GT(volume, 0) << seed;
    for (const auto& [name, content] : dialects_of(body)) {
      const TriMesh read = read_mesh_file(name, content).mesh;
      ASSERT_EQ(facets_of(read), facets) << name << ' ' << seed;
      ASSERT_NEAR(volume_of(read), volume, 1e-9 * volume) << name << ' ' << seed;
    }
    for (const char* name : {"own.obj", "own.ply", "own.stl", "own.vtp"}) {
      const TemporaryFolder folder;
      write_mesh(folder / name, body.mesh);
      ASSERT_EQ(facets_of(read_mesh(folder / name)), facets) << name << ' ' << seed;
    }
  }
}

TEST(MeshDialects, AllGiveTheSameFacets) { run_campaign(1, 5); }

TEST(SlowMeshDialects, AllGiveTheSameFacets) { run_campaign(6, 205); }

}  // namespace
}  // namespace scarp
