#include "mesh/files/region_file.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <set>
#include <tuple>

#include "core/error.h"
#include "core/printable.h"
#include "core/system/atomic_file.h"
#include "core/system/read_file.h"
#include "mesh/files/mesh_format.h"

namespace scarp {

namespace {

constexpr std::uint32_t none = ~std::uint32_t{0};

const std::string& region_name(const RegionMesh& mesh, int body) {
  const int region = mesh.bodies[static_cast<std::size_t>(body)].region;
  return mesh.regions[static_cast<std::size_t>(region)].name;
}

bool is_meshed(const RegionMesh& mesh, int body) {
  if (body == RegionMesh::nothing) return false;
  const int region = mesh.bodies[static_cast<std::size_t>(body)].region;
  return mesh.regions[static_cast<std::size_t>(region)].is_meshed;
}

std::string border_name(const RegionMesh& mesh, std::array<int, 2> bodies, int side) {
  static constexpr std::array<const char*, RegionMesh::side_count> sides{
      "_x_min", "_x_max", "_y_min", "_y_max", "_bottom", "_top"};
  if (bodies[1] == RegionMesh::nothing)
    return region_name(mesh, bodies[0]) + sides[static_cast<std::size_t>(std::max(side, 0))];
  const auto region = [&](int body) { return mesh.bodies[static_cast<std::size_t>(body)].region; };
  if (region(bodies[0]) > region(bodies[1])) std::swap(bodies[0], bodies[1]);
  return region_name(mesh, bodies[0]) + '_' + region_name(mesh, bodies[1]);
}

/// Groups by what they are between, in the order of what they are between.
class Grouping {
 public:
  Grouping(const RegionMesh& mesh, int dimension) : mesh_(mesh), dimension_(dimension) {}

  void add(std::array<int, 2> bodies, int side, std::span<const std::uint32_t> corners) {
    ElementGroup& group = groups_[{bodies, side}];
    group.corners.insert(group.corners.end(), corners.begin(), corners.end());
  }

  void move_to(std::vector<ElementGroup>& groups) {
    for (auto& [key, group] : groups_) {
      group.dimension = dimension_;
      group.bodies = std::get<0>(key);
      group.name = border_name(mesh_, group.bodies, std::get<1>(key));
      groups.push_back(std::move(group));
    }
  }

 private:
  const RegionMesh& mesh_;
  int dimension_;
  std::map<std::tuple<std::array<int, 2>, int>, ElementGroup> groups_;
};

void add_bodies(const RegionMesh& mesh, int dimension, std::span<const BodyTet> tets,
                std::vector<ElementGroup>& groups) {
  std::map<int, ElementGroup> bodies;
  for (const BodyTet& tet : tets)
    bodies[tet.body].corners.insert(bodies[tet.body].corners.end(), tet.corners.begin(),
                                    tet.corners.end());
  if (mesh.is_flat) {
    for (const RegionMesh::Facet& facet : mesh.facets) {
      const int body = facet.bodies[0];
      if (is_meshed(mesh, body))
        bodies[body].corners.insert(bodies[body].corners.end(), facet.corners.begin(),
                                    facet.corners.end());
    }
  }
  for (auto& [body, group] : bodies) {
    group.dimension = dimension;
    group.bodies = {body, RegionMesh::nothing};
    group.name = region_name(mesh, body);
    groups.push_back(std::move(group));
  }
}

/// Vertices that no element uses are none; the others keep their order.
void keep_used(NamedMesh& mesh) {
  std::vector<std::uint32_t> number(mesh.vertices.size(), none);
  for (const ElementGroup& group : mesh.groups)
    for (const std::uint32_t v : group.corners) number[v] = 0;
  std::vector<Vec3d> kept;
  for (std::size_t v = 0; v < number.size(); ++v) {
    if (number[v] == none) continue;
    number[v] = static_cast<std::uint32_t>(kept.size());
    kept.push_back(mesh.vertices[v]);
  }
  for (ElementGroup& group : mesh.groups)
    for (std::uint32_t& v : group.corners) v = number[v];
  mesh.vertices = std::move(kept);
}

NamedMesh flat_mesh(const RegionMesh& mesh) {
  NamedMesh named{.vertices = {}, .groups = {}, .regions = mesh.regions, .bodies = mesh.bodies};
  for (const Vec3d& r : mesh.vertices) named.vertices.push_back({r.x, r.z, 0});
  Grouping lines(mesh, 1);
  for (const RegionLine& line : lines_of(mesh))
    if (is_meshed(mesh, line.bodies[0]) || is_meshed(mesh, line.bodies[1]))
      lines.add(line.bodies, line.side, line.ends);
  lines.move_to(named.groups);
  add_bodies(mesh, 2, {}, named.groups);
  keep_used(named);
  return named;
}

}  // namespace

bool NamedMesh::is_filled() const {
  return groups.back().dimension == 3 || groups.front().dimension == 1;
}

NamedMesh named_mesh(const RegionMesh& mesh) {
  if (mesh.is_flat) return flat_mesh(mesh);
  return filled_mesh(mesh, mesh.vertices, {});
}

NamedMesh filled_mesh(const RegionMesh& mesh, std::vector<Vec3d> vertices,
                      std::span<const BodyTet> tets) {
  NamedMesh named{.vertices = std::move(vertices),
                  .groups = {},
                  .regions = mesh.regions,
                  .bodies = mesh.bodies};
  Grouping surfaces(mesh, 2);
  for (const RegionMesh::Facet& facet : mesh.facets)
    if (is_meshed(mesh, facet.bodies[0]) || is_meshed(mesh, facet.bodies[1]))
      surfaces.add(facet.bodies, facet.side, facet.corners);
  surfaces.move_to(named.groups);
  add_bodies(mesh, 3, tets, named.groups);
  keep_used(named);
  return named;
}

namespace {

std::string place_text(const Vec3d& r) {
  return number_text(r.x) + ' ' + number_text(r.y) + ' ' + number_text(r.z);
}

std::string text_of(std::uint64_t number) { return std::to_string(number); }

/// The text of gmsh's format 4.1. Groups are entities, numbered from 1 for each dimension; of
/// volumes that are not filled the number is that of their body.
class MshText {
 public:
  explicit MshText(const NamedMesh& mesh) : mesh_(mesh) {
    std::array<int, 4> count{};
    for (const ElementGroup& group : mesh.groups) {
      const auto dimension = static_cast<std::size_t>(group.dimension);
      tags_.push_back(++count[dimension]);
      auto& names = names_[dimension];
      names.try_emplace(group.name, static_cast<int>(names.size()) + 1);
    }
    if (!mesh.is_filled()) {
      // The names that volumes get when they are filled.
      for (const MeshRegion& region : mesh.regions)
        if (region.is_meshed)
          names_[3].try_emplace(region.name, static_cast<int>(names_[3].size()) + 1);
    }
  }

  std::string text() const {
    return "$MeshFormat\n4.1 0 8\n$EndMeshFormat\n" + names() + entities() + nodes() + elements();
  }

  /// What encloses the volumes.
  std::string volumes() const {
    std::string text = "// Volumes between the surfaces of the mesh; gmsh reads this with it.\n";
    for (std::size_t body = 0; body < mesh_.bodies.size(); ++body) {
      const MeshRegion& region = mesh_.regions[static_cast<std::size_t>(mesh_.bodies[body].region)];
      if (!region.is_meshed) continue;
      std::string loop;
      for (std::size_t n = 0; n < mesh_.groups.size(); ++n) {
        const auto [behind, front] = mesh_.groups[n].bodies;
        if (behind != static_cast<int>(body) && front != static_cast<int>(body)) continue;
        if (!loop.empty()) loop += ", ";
        loop += std::to_string(behind == static_cast<int>(body) ? tags_[n] : -tags_[n]);
      }
      const std::string tag = std::to_string(body + 1);
      text += "Surface Loop(" + tag + ") = {" + loop + "};\nVolume(" + tag + ") = {" + tag + "};\n";
    }
    for (const auto& [name, number] : names_[3]) {
      std::string tags;
      for (std::size_t body = 0; body < mesh_.bodies.size(); ++body) {
        const MeshRegion& region =
            mesh_.regions[static_cast<std::size_t>(mesh_.bodies[body].region)];
        if (region.is_meshed && region.name == name)
          tags.append(tags.empty() ? "" : ", ").append(std::to_string(body + 1));
      }
      if (tags.empty()) continue;
      text +=
          "Physical Volume(\"" + name + "\", " + std::to_string(number) + ") = {" + tags + "};\n";
    }
    return text;
  }

 private:
  std::string names() const {
    std::size_t count = 0;
    std::string lines;
    for (std::size_t dimension = 0; dimension < names_.size(); ++dimension) {
      count += names_[dimension].size();
      for (const auto& [name, number] : names_[dimension])
        lines += text_of(dimension) + ' ' + std::to_string(number) + " \"" + name + "\"\n";
    }
    return "$PhysicalNames\n" + text_of(count) + '\n' + lines + "$EndPhysicalNames\n";
  }

  int name_number(const ElementGroup& group) const {
    return names_[static_cast<std::size_t>(group.dimension)].at(group.name);
  }

  std::string entities() const {
    std::array<int, 4> count{};
    std::string lines;
    for (std::size_t n = 0; n < mesh_.groups.size(); ++n) {
      const ElementGroup& group = mesh_.groups[n];
      ++count[static_cast<std::size_t>(group.dimension)];
      Box box;
      for (const std::uint32_t v : group.corners) box.add(mesh_.vertices[v]);
      lines += std::to_string(tags_[n]) + ' ' + place_text(box.lower) + ' ' +
               place_text(box.upper) + " 1 " + std::to_string(name_number(group)) + border_of(n) +
               '\n';
    }
    std::string head = "$Entities\n";
    for (std::size_t dimension = 0; dimension < 4; ++dimension)
      head += std::to_string(count[dimension]) + (dimension < 3 ? " " : "\n");
    return head + lines + "$EndEntities\n";
  }

  /// The entities around one, each with the sign of its direction.
  std::string border_of(std::size_t n) const {
    const ElementGroup& group = mesh_.groups[n];
    std::vector<int> around;
    for (std::size_t m = 0; m < n; ++m) {
      const ElementGroup& border = mesh_.groups[m];
      if (border.dimension != group.dimension - 1 || group.bodies[1] != RegionMesh::nothing ||
          !mesh_.is_filled())
        continue;
      if (border.bodies[0] == group.bodies[0]) around.push_back(tags_[m]);
      if (border.bodies[1] == group.bodies[0]) around.push_back(-tags_[m]);
    }
    // Sides in space have nothing in front either and are no bodies.
    if (group.dimension == 2 && mesh_.groups.front().dimension == 2) around.clear();
    std::string text = ' ' + text_of(around.size());
    for (const int tag : around) text += ' ' + std::to_string(tag);
    return text;
  }

  /// A node belongs to the first group that uses it, of the lowest dimension.
  std::string nodes() const {
    std::vector<bool> is_known(mesh_.vertices.size());
    std::size_t blocks = 0;
    std::string lines;
    for (std::size_t n = 0; n < mesh_.groups.size(); ++n) {
      std::vector<std::uint32_t> own;
      for (const std::uint32_t v : mesh_.groups[n].corners) {
        if (is_known[v]) continue;
        is_known[v] = true;
        own.push_back(v);
      }
      if (own.empty()) continue;
      ++blocks;
      lines += std::to_string(mesh_.groups[n].dimension) + ' ' + std::to_string(tags_[n]) + " 0 " +
               text_of(own.size()) + '\n';
      for (const std::uint32_t v : own) lines += text_of(v + std::uint64_t{1}) + '\n';
      for (const std::uint32_t v : own) lines += place_text(mesh_.vertices[v]) + '\n';
    }
    const std::string count = text_of(mesh_.vertices.size());
    return "$Nodes\n" + text_of(blocks) + ' ' + count + " 1 " + count + '\n' + lines +
           "$EndNodes\n";
  }

  std::string elements() const {
    std::uint64_t element = 0;
    std::string lines;
    for (std::size_t n = 0; n < mesh_.groups.size(); ++n) {
      const ElementGroup& group = mesh_.groups[n];
      const auto corner_count = static_cast<std::size_t>(group.dimension) + 1;
      static constexpr std::array<const char*, 4> types{"15", "1", "2", "4"};
      lines += std::to_string(group.dimension) + ' ' + std::to_string(tags_[n]) + ' ' +
               types[static_cast<std::size_t>(group.dimension)] + ' ' +
               text_of(group.corners.size() / corner_count) + '\n';
      for (std::size_t c = 0; c < group.corners.size(); ++c) {
        if (c % corner_count == 0) lines += text_of(++element);
        lines += ' ' + text_of(group.corners[c] + std::uint64_t{1});
        if (c % corner_count == corner_count - 1) lines += '\n';
      }
    }
    const std::string count = text_of(element);
    return "$Elements\n" + text_of(mesh_.groups.size()) + ' ' + count + " 1 " + count + '\n' +
           lines + "$EndElements\n";
  }

  const NamedMesh& mesh_;
  std::vector<int> tags_;
  std::array<std::map<std::string, int>, 4> names_;  ///< of each dimension, numbered from 1
};

}  // namespace

void write_msh(const std::filesystem::path& file, const NamedMesh& mesh) {
  const MshText msh(mesh);
  write_file(file, msh.text());
  std::filesystem::path volumes = file;
  volumes += ".opt";
  if (mesh.is_filled()) {
    // That of closed surfaces of the same name would no longer be true.
    std::filesystem::remove(volumes);
  } else {
    write_file(volumes, msh.volumes());
  }
}

void write_smesh(const std::filesystem::path& file, const RegionMesh& mesh) {
  const NamedMesh named = named_mesh(mesh);
  std::map<std::string, int> markers;
  std::size_t facet_count = 0;
  for (const ElementGroup& group : named.groups) {
    markers.try_emplace(group.name, static_cast<int>(markers.size()) + 1);
    facet_count += group.corners.size() / 3;
  }
  std::string text = "# Closed surfaces of a wafer, in nm: tetgen -pA fills them.\n";
  for (std::size_t n = 0; n < mesh.regions.size(); ++n)
    if (mesh.regions[n].is_meshed)
      text += "# region " + text_of(n + 1) + ": " + mesh.regions[n].name + '\n';
  for (const auto& [name, marker] : markers)
    text += "# marker " + std::to_string(marker) + ": " + name + '\n';
  text += text_of(named.vertices.size()) + " 3 0 0\n";
  for (std::size_t v = 0; v < named.vertices.size(); ++v)
    text += text_of(v + 1) + ' ' + place_text(named.vertices[v]) + '\n';
  text += text_of(facet_count) + " 1\n";
  for (const ElementGroup& group : named.groups) {
    const std::string marker = ' ' + std::to_string(markers.at(group.name)) + '\n';
    for (std::size_t c = 0; c < group.corners.size(); c += 3) {
      text += '3';
      for (std::size_t n = 0; n < 3; ++n)
        text += ' ' + text_of(group.corners[c + n] + std::uint64_t{1});
      text += marker;
    }
  }
  const std::vector<std::optional<Vec3d>> points = inner_points(mesh);
  std::string holes;
  std::string regions;
  std::size_t hole_count = 0;
  std::size_t region_count = 0;
  for (std::size_t body = 0; body < points.size(); ++body) {
    if (!points[body]) continue;
    const int region = mesh.bodies[body].region;
    const MeshRegion& own = mesh.regions[static_cast<std::size_t>(region)];
    if (own.is_meshed) {
      regions += text_of(++region_count) + ' ' + place_text(*points[body]) + ' ' +
                 std::to_string(region + 1) + " -1\n";
    } else if (own.kind == MeshRegion::Kind::closed_void) {
      holes += text_of(++hole_count) + ' ' + place_text(*points[body]) + '\n';
    }
  }
  write_file(file,
             text + text_of(hole_count) + '\n' + holes + text_of(region_count) + '\n' + regions);
}

namespace {

/// An unstructured grid with raw arrays behind its description.
class VtuText {
 public:
  template <class T>
  void add(const std::string& name, const char* type, int components,
           const std::vector<T>& values) {
    xml_ += "        <DataArray type=\"" + std::string(type) + "\" Name=\"" + name + '"';
    if (components > 1) xml_ += " NumberOfComponents=\"" + std::to_string(components) + '"';
    xml_ += " format=\"appended\" offset=\"" + text_of(appended_.size()) + "\"/>\n";
    const std::uint64_t size = values.size() * sizeof(T);
    appended_.append(reinterpret_cast<const char*>(&size), sizeof(size));  // NOLINT
    appended_.append(reinterpret_cast<const char*>(values.data()), size);  // NOLINT
  }

  void add_names(const std::string& name, const std::vector<std::string>& words) {
    xml_ += "      <Array type=\"String\" Name=\"" + name + "\" NumberOfTuples=\"" +
            text_of(words.size()) + "\" format=\"ascii\">";
    for (const std::string& word : words) {
      for (const char c : word)
        xml_ += ' ' + std::to_string(static_cast<int>(static_cast<unsigned char>(c)));
      xml_ += " 0";
    }
    xml_ += "</Array>\n";
  }

  void line(const std::string& text) { xml_ += text + '\n'; }

  std::string text() const {
    return xml_ + "  <AppendedData encoding=\"raw\">\n_" + appended_ +
           "\n  </AppendedData>\n</VTKFile>\n";
  }

 private:
  std::string xml_;
  std::string appended_;
};

/// The cells of the highest dimension.
struct VtuCells {
  std::vector<std::int64_t> connectivity;
  std::vector<std::int64_t> offsets;
  std::vector<std::uint8_t> types;
  std::vector<std::int32_t> behind;
  std::vector<std::int32_t> in_front;
  std::vector<std::int32_t> surface;
  std::vector<std::string> surface_names;
};

VtuCells cells_of(const NamedMesh& mesh) {
  VtuCells cells;
  const int dimension = mesh.groups.back().dimension;
  const auto corner_count = static_cast<std::size_t>(dimension) + 1;
  const auto region = [&](int body) {
    return body == RegionMesh::nothing ? -1 : mesh.bodies[static_cast<std::size_t>(body)].region;
  };
  for (const ElementGroup& group : mesh.groups) {
    if (group.dimension != dimension) continue;
    const auto name = std::ranges::find(cells.surface_names, group.name);
    const auto number = static_cast<std::int32_t>(name - cells.surface_names.begin());
    if (name == cells.surface_names.end()) cells.surface_names.push_back(group.name);
    for (std::size_t c = 0; c < group.corners.size(); ++c) {
      cells.connectivity.push_back(group.corners[c]);
      if (c % corner_count != corner_count - 1) continue;
      cells.offsets.push_back(static_cast<std::int64_t>(cells.connectivity.size()));
      constexpr std::uint8_t vtk_triangle = 5;
      constexpr std::uint8_t vtk_tetrahedron = 10;
      cells.types.push_back(dimension == 3 ? vtk_tetrahedron : vtk_triangle);
      cells.behind.push_back(region(group.bodies[0]));
      cells.in_front.push_back(region(group.bodies[1]));
      cells.surface.push_back(number);
    }
  }
  return cells;
}

}  // namespace

void write_vtu(const std::filesystem::path& file, const NamedMesh& mesh) {
  const VtuCells cells = cells_of(mesh);
  VtuText vtu;
  vtu.line("<?xml version=\"1.0\"?>");
  vtu.line(
      "<VTKFile type=\"UnstructuredGrid\" version=\"1.0\" byte_order=\"LittleEndian\" "
      "header_type=\"UInt64\">");
  vtu.line("  <UnstructuredGrid>\n    <FieldData>");
  std::vector<std::string> region_names;
  for (const MeshRegion& region : mesh.regions) region_names.push_back(region.name);
  vtu.add_names("region_names", region_names);
  if (!mesh.is_filled()) vtu.add_names("surface_names", cells.surface_names);
  vtu.line("    </FieldData>\n    <Piece NumberOfPoints=\"" + text_of(mesh.vertices.size()) +
           "\" NumberOfCells=\"" + text_of(cells.types.size()) + "\">\n      <CellData>");
  if (mesh.is_filled()) {
    vtu.add("region", "Int32", 1, cells.behind);
  } else {
    vtu.add("surface", "Int32", 1, cells.surface);
    vtu.add("region_behind", "Int32", 1, cells.behind);
    vtu.add("region_in_front", "Int32", 1, cells.in_front);
  }
  vtu.line("      </CellData>\n      <Points>");
  std::vector<double> places;
  for (const Vec3d& r : mesh.vertices) places.insert(places.end(), {r.x, r.y, r.z});
  vtu.add("points", "Float64", 3, places);
  vtu.line("      </Points>\n      <Cells>");
  vtu.add("connectivity", "Int64", 1, cells.connectivity);
  vtu.add("offsets", "Int64", 1, cells.offsets);
  vtu.add("types", "UInt8", 1, cells.types);
  vtu.line("      </Cells>\n    </Piece>\n  </UnstructuredGrid>");
  write_file(file, vtu.text());
}

namespace {

/// Numbers one after the other.
class NumberReader {
 public:
  NumberReader(const MeshText& text) : text_(text), words_(text_) {}

  double number() { return words_.number(word()); }
  std::uint32_t index() {
    const std::int64_t value = words_.integer(word());
    if (value < 0 || value >= none) words_.fail("has an index out of range");
    return static_cast<std::uint32_t>(value);
  }
  std::string_view word() { return words_.word_across_lines(); }
  void skip_to(std::string_view wanted) {
    for (std::string_view next = word(); next != wanted; next = word())
      if (next.empty()) words_.fail("ends before " + std::string(wanted));
  }
  [[noreturn]] void fail(const std::string& what) const { words_.fail(what); }

 private:
  const MeshText& text_;
  WordReader words_;
};

void check_tets(const std::string& name, const ReadTets& read) {
  if (read.tets.empty()) throw InputError(name + ": has no tetrahedra");
  for (const BodyTet& tet : read.tets)
    for (const std::uint32_t v : tet.corners)
      if (v >= read.vertices.size())
        throw InputError(name + ": has a tetrahedron with a corner that is no node");
}

}  // namespace

ReadTets read_gmsh_tets(const std::filesystem::path& file) {
  const std::string content = read_file(file);
  const MeshText text{shown(file), content};
  NumberReader in(text);
  ReadTets read;
  std::map<std::uint32_t, Vec3d> nodes;
  in.skip_to("$Nodes");
  const std::uint32_t node_blocks = in.index();
  for (int n = 0; n < 3; ++n) in.index();
  for (std::uint32_t block = 0; block < node_blocks; ++block) {
    for (int n = 0; n < 3; ++n) in.word();
    const std::uint32_t count = in.index();
    std::vector<std::uint32_t> tags;
    for (std::uint32_t n = 0; n < count; ++n) tags.push_back(in.index());
    for (const std::uint32_t tag : tags)
      for (int axis = 0; axis < 3; ++axis) nodes[tag][axis] = in.number();
  }
  std::map<std::uint32_t, std::uint32_t> number;
  for (const auto& [tag, r] : nodes) {
    number[tag] = static_cast<std::uint32_t>(read.vertices.size());
    read.vertices.push_back(r);
  }
  in.skip_to("$Elements");
  const std::uint32_t blocks = in.index();
  for (int n = 0; n < 3; ++n) in.index();
  for (std::uint32_t block = 0; block < blocks; ++block) {
    const std::uint32_t dimension = in.index();
    const std::uint32_t entity = in.index();
    in.word();
    const std::uint32_t count = in.index();
    for (std::uint32_t n = 0; n < count; ++n) {
      in.word();
      BodyTet tet{.body = static_cast<int>(entity) - 1};
      for (std::uint32_t c = 0; c <= dimension; ++c) {
        const auto found = number.find(in.index());
        if (found == number.end()) in.fail("has an element with a corner that is no node");
        if (dimension == 3) tet.corners[c] = found->second;
      }
      if (dimension == 3) read.tets.push_back(tet);
    }
  }
  check_tets(text.name, read);
  return read;
}

ReadTets read_tetgen_tets(const std::filesystem::path& stem) {
  ReadTets read;
  std::filesystem::path file = stem;
  file += ".node";
  const std::string nodes = read_file(file);
  const MeshText node_text{shown(file), nodes};
  NumberReader in(node_text);
  const std::uint32_t node_count = in.index();
  in.word();
  const std::uint32_t attributes = in.index() + in.index();
  for (std::uint32_t n = 0; n < node_count; ++n) {
    if (in.index() != n + 1) in.fail("has nodes in another order");
    Vec3d r;
    for (int axis = 0; axis < 3; ++axis) r[axis] = in.number();
    for (std::uint32_t a = 0; a < attributes; ++a) in.word();
    read.vertices.push_back(r);
  }
  file = stem;
  file += ".ele";
  const std::string elements = read_file(file);
  const MeshText element_text{shown(file), elements};
  NumberReader tets(element_text);
  const std::uint32_t tet_count = tets.index();
  tets.word();
  if (tets.index() != 1) tets.fail("has no regions");
  for (std::uint32_t n = 0; n < tet_count; ++n) {
    tets.word();
    BodyTet tet;
    for (std::uint32_t& v : tet.corners) v = tets.index() - 1;
    tet.body = static_cast<int>(std::lround(tets.number())) - 1;
    read.tets.push_back(tet);
  }
  check_tets(element_text.name, read);
  return read;
}

}  // namespace scarp
