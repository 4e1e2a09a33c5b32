#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "apps/report/packed_surface.h"
#include "apps/report/packed_volume.h"
#include "apps/run/run_record.h"
#include "core/frame.h"

namespace scarp {

// What the viewer of a page shows in space (apps/viewer).

/// A surface at one moment of a process. Units: s.
struct SceneOutput {
  double time = 0;
  std::string moment;  ///< "after etch"; may be empty
  PackedSurface surface{};
  PackedVolume volume{};  ///< without materials where it is not known
};

/// The outputs of one run, beside those of others.
struct ScenePane {
  std::string name;
  std::vector<SceneOutput> outputs{};
  std::size_t output_count = 0;  ///< before some were left out
};

struct Scene {
  std::vector<std::string> material_names{};
  std::vector<ScenePane> panes{};

  /// How far a place may be from that of the files. Units: nm.
  double place_error() const;
};

/// A surface with what is known of its facets.
///
/// Shape: one value per facet in each field.
struct FieldMesh {
  TriMesh mesh;
  std::vector<FacetArray> fields{};
};

/// The surface of an output as its .vtp file has it; where there is none, that of the state.
///
/// Adds the number of the material, the mean curvature [1/um] and the size [nm] of each facet: the
/// side of a square of its area.
FieldMesh read_field_mesh(const RunOutput& output, const Sides& sides);

/// The names of the materials of a run by the numbers in its surfaces; the wafer is its newest.
std::vector<std::string> material_names_of(const RunRecord& run, const SavedWafer& wafer);

/// Gives the materials of a surface the numbers that they have in a scene of several runs.
///
/// Shape: names by their numbers in the surface; a number without a name stays.
void renumber_materials(FieldMesh& surface, std::span<const std::string> names, Scene& scene);

/// Adds what lies below the surfaces of a pane, from the states of its outputs.
///
/// Shape: runs[p] is that of pane p, outputs[p][n] which of its outputs n is.
void add_volumes(Scene& scene, std::span<const RunRecord* const> runs,
                 std::span<const std::vector<std::size_t>> outputs);

/// What the scenes of a page may take, together, for it to stay below 15 MB.
inline constexpr std::size_t most_scene_bytes = 13'000'000;

/// Leaves out outputs, evenly, the first and the last last of all, until those that are left take
/// no more bytes in a page. One of each pane always stays.
void thin_out(Scene& scene, std::size_t most_bytes);

/// The wafer as it is now as an <img>: for print, and for where the viewer cannot run.
std::string wafer_picture(const SavedWafer& wafer);

/// The element that the viewer fills, with all that it shows and the pictures that stand there
/// without it.
std::string scene_html(const Scene& scene, const std::string& id, const std::string& pictures);

}  // namespace scarp
