#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "core/tri_mesh.h"

namespace scarp {

/// A named array over the facets or over the vertices of a mesh. The caller keeps the values alive.
struct FieldView {
  using Values =
      std::variant<std::span<const float>, std::span<const double>, std::span<const std::int32_t>,
                   std::span<const std::uint16_t>, std::span<const Vec3f>>;
  std::string name;
  Values values;
};

/// What a .vtp file carries besides the surface.
///
/// Shape: one value per triangle in each array of facets, one per vertex in each of vertices; names
///        are those of the materials 0, 1, ..., written as the field data `material_names`; the
///        time, in s, is the field data `process_time_s`.
struct MeshFields {
  std::vector<FieldView> facets;
  std::vector<FieldView> vertices;
  std::vector<std::string> material_names{};
  std::optional<double> time{};
};

/// A mesh and what its file holds besides: names with counts, ready for a message.
struct MeshFile {
  TriMesh mesh;
  std::vector<std::string> left_out;       ///< what has a place: "3 lines", "1 vertex alone"
  std::vector<std::string> data_left_out;  ///< what facets and vertices carry: "point data \"T\""
};

/// Reads .obj, .ply, .stl or .vtp, told apart by the ending of the name. docs/meshes.md says what
/// of each format is read, left out and refused.
///
/// Vertices keep their order and number, those that no triangle uses included; for .stl, corners
/// with the same coordinates become one vertex, numbered by first use. Polygons are cut in halves
/// until they are triangles, those that are not convex by their ears. Triangle strips follow the
/// polygons.
/// A facet array `material` of a .vtp file becomes the materials; other arrays are not read.
///
/// Units:  none; the file's own.
/// Throws: InputError, with the line or the vertex, if the file cannot be read, ends early, holds
///         coordinates that are not finite or too far from the origin for their facets, indices
///         without a vertex, a vertex with more than 4096 facets, a polygon that crosses itself or
///         is not convex with more than 4096 corners, or has no triangle.
MeshFile read_mesh_file(const std::filesystem::path& file);

/// As read_mesh_file, of the content of a file that was read before.
MeshFile read_mesh_file(const std::filesystem::path& file, std::string_view content);

/// The mesh alone.
TriMesh read_mesh(const std::filesystem::path& file);

/// "leaves out 3 lines, 1 normal"; empty where nothing is left out.
std::string left_out_text(std::span<const std::string> things);

/// A named array over the facets of a file.
struct FacetArray {
  std::string name;
  std::vector<float> values;
};

/// The arrays over facets of a .vtp file with one number per facet, in the order of the file;
/// triangles cut from one polygon or strip have its value.
///
/// Throws: as read_mesh.
std::vector<FacetArray> read_facet_arrays(const std::filesystem::path& file);

/// The names of the materials 0, 1, ... in a .vtp file, as write_vtp puts them there; empty where
/// there are none.
///
/// Throws: as read_mesh.
std::vector<std::string> read_material_names(const std::filesystem::path& file);

/// Writes .obj (shortest text that reads back to the same bits), .ply, .stl (both binary), .vtp
/// (appended binary; materials as the facet array `material`) or .vtu (the same as an unstructured
/// grid of triangles). The file appears whole or not at
/// all.
///
/// Throws: InputError if the ending is another one or the file cannot be made; NumericalError if
///         the disk is full.
void write_mesh(const std::filesystem::path& file, const TriMesh& mesh);

/// As write_mesh for a .vtp file, with arrays on facets and vertices that ParaView shows by name.
void write_vtp(const std::filesystem::path& file, const TriMesh& mesh, const MeshFields& fields);

/// Writes a .pvd file: ParaView opens the outputs of a run, .vtp files by their names relative to
/// the folder, as one surface that changes.
///
/// The timestep of each is its place in the list, from 0: viewers pick by it, and process times
/// repeat where a step acts at once.
void write_series(const std::filesystem::path& file, std::span<const std::string> outputs);

}  // namespace scarp
