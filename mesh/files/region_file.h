#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include "core/region_mesh.h"

namespace scarp {

/// Elements that belong together: what is of a body, or where two bodies meet.
struct ElementGroup {
  int dimension = 0;  ///< 1: lines, 2: triangles, 3: tetrahedra
  std::string name;   ///< several groups may have one name
  /// The body itself and nothing; of an interface the one behind it and the one in front.
  std::array<int, 2> bodies{RegionMesh::nothing, RegionMesh::nothing};
  std::vector<std::uint32_t> corners{};  ///< dimension + 1 of each element
};

/// A mesh for other programs. Flat ones have x and z of the section as x and y.
struct NamedMesh {
  std::vector<Vec3d> vertices;
  std::vector<ElementGroup> groups;  ///< those of lower dimension first
  std::vector<MeshRegion> regions;
  std::vector<RegionMesh::Body> bodies;

  bool is_filled() const;  ///< with tetrahedra, or a flat mesh
};

/// The facets of a region mesh by what they are between; of a flat one its lines as well. What is
/// not meshed is left out.
///
/// Interfaces are called after their regions, the lower one first: Si_SiO2. Sides are called
/// Si_x_min, Si_x_max, Si_y_min, Si_y_max, Si_bottom, and gas_top.
NamedMesh named_mesh(const RegionMesh& mesh);

/// A tetrahedron and the body that it is in.
struct BodyTet {
  std::array<std::uint32_t, 4> corners{};
  int body = 0;
};

/// The same mesh, filled: vertices are those of the region mesh and others after them.
NamedMesh filled_mesh(const RegionMesh& mesh, std::vector<Vec3d> vertices,
                      std::span<const BodyTet> tets);

/// Writes gmsh's format 4.1, as text. Groups are entities, names are physical groups.
///
/// Closed surfaces have a file beside them, `NAME.msh.opt`, that gmsh reads when it opens them: it
/// says which surfaces enclose which volume, so that `gmsh -3 NAME.msh` fills them.
///
/// Throws: as write_file.
void write_msh(const std::filesystem::path& file, const NamedMesh& mesh);

/// Writes closed surfaces for tetgen: facets with a marker for each name, a point in each body with
/// the number of its region as attribute, counted from 1, and holes in closed voids that are not
/// meshed. Comments list the names.
///
/// Throws: as write_file. Pre: the mesh is not flat.
void write_smesh(const std::filesystem::path& file, const RegionMesh& mesh);

/// Writes an unstructured grid for ParaView. Tetrahedra and flat meshes have the array `region`;
/// surfaces have `surface`, `region_behind` and `region_in_front`, -1 beyond the sides. The names
/// are the field data `region_names` and `surface_names`.
///
/// Throws: as write_file.
void write_vtu(const std::filesystem::path& file, const NamedMesh& mesh);

/// Tetrahedra as a program left them; the numbers of bodies are those of its regions less one.
struct ReadTets {
  std::vector<Vec3d> vertices;
  std::vector<BodyTet> tets;
};

/// Reads what `gmsh -3` makes of a file of write_msh: its nodes first, in their order.
///
/// Throws: InputError if it has no tetrahedra or cannot be read.
ReadTets read_gmsh_tets(const std::filesystem::path& file);

/// Reads STEM.node and STEM.ele. The attributes are numbers of regions, not of bodies.
///
/// Throws: InputError if they have no tetrahedra or cannot be read.
ReadTets read_tetgen_tets(const std::filesystem::path& stem);

}  // namespace scarp
