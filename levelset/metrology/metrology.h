// A public header: installed as scarp/levelset/metrology/metrology.h.
#pragma once

#include <array>
#include <optional>
#include <vector>

#include "core/vec3.h"
#include "levelset/grid/layers.h"
#include "levelset/metrology/opening_names.h"

namespace scarp {

// What engineers read off a wafer, measured on cross-sections of the extracted surfaces.
// docs/metrology.md defines every quantity, with a drawing.
//
// Units: nm, nm^2, nm^3, rad. Nothing stands for what is not there, such as the bow of a wall that
// has none.

struct MetrologyOptions {
  /// What lies on the structure as a mask: openings are measured in what is below the lowest layer
  /// of these. None: on the exposed surface.
  std::vector<MaterialId> masks{};
  /// Heights at which widths are wanted.
  std::vector<double> cd_heights{};
  /// Heights at which the angles of walls are wanted.
  std::vector<double> angle_heights{};
  /// Something was etched at speeds that depend on the slope: the grid rounds the feet of walls,
  /// and lowest points have an error.
  bool feet_are_rounded = false;
};

/// How thick a material lies on an opening; of several layers their sum.
struct FilmMetrology {
  MaterialId material = 0;
  std::optional<double> top{};            ///< on the field
  std::optional<double> wall{};           ///< half-way up the wall under it, along the shortest way
  std::optional<double> bottom{};         ///< in the middle
  std::optional<double> conformality{};   ///< the thinnest by the thickest place
  std::optional<double> step_coverage{};  ///< bottom by top
  std::optional<double> wall_coverage{};  ///< wall by top
};

/// One opening in parallel cross-sections; values are means over them.
struct OpeningMetrology {
  int opening = 0;                 ///< its number, see OpeningNames
  bool is_trench = false;          ///< else a hole, which is cut along x and along y
  std::array<double, 2> centre{};  ///< x and y; 0 along a trench
  std::array<double, 2> width{};   ///< of the box around it, seen from above
  int axis = 1;                    ///< the sections lie across this axis
  int section_count = 0;

  std::optional<double> depth{};
  std::optional<double> depth_error{};  ///< of the grid, at feet of walls; of etched_depth as well
  std::optional<double> aspect_ratio{};
  std::optional<double> top_cd{};
  std::optional<double> middle_cd{};
  std::optional<double> bottom_cd{};
  std::optional<double> neck_cd{};
  std::optional<double> neck_depth{};
  std::optional<double> bow{};
  std::optional<double> bow_depth{};
  std::optional<double> sidewall_angle{};
  std::optional<double> left_angle{};
  std::optional<double> right_angle{};
  std::optional<double> micro_trenching{};
  std::optional<double> micro_trenching_error{};  ///< likewise
  std::optional<double> facet_width{};
  std::optional<double> scallop_pitch{};
  std::optional<double> scallop_amplitude{};
  std::optional<double> wall_roughness{};
  std::optional<double> line_width_roughness{};
  std::optional<double> undercut{};
  std::optional<double> mask_thickness{};
  std::optional<double> etched_depth{};
  std::optional<double> mask_loss{};
  std::optional<double> selectivity{};
  std::optional<double> arde_lag{};
  std::vector<std::optional<double>> cd_at{};  ///< at MetrologyOptions::cd_heights
  /// Of the left and the right wall at MetrologyOptions::angle_heights.
  std::vector<std::array<std::optional<double>, 2>> angle_at{};
  std::vector<FilmMetrology> films{};  ///< of all layers but the lowest, from below

  std::optional<double> bottom_height{};  ///< of the structure in the middle, also if it is flat
  std::optional<double> lowest_height{};  ///< of the structure
};

/// A closed void. Units: nm, nm^2, nm^3; the volume is that of Region.
struct VoidMetrology {
  Vec3d centre{};  ///< of the box around it
  double lower = 0;
  double upper = 0;
  double area = 0;  ///< in the cross-section across y through its centre
  double volume = 0;

  double height() const { return upper - lower; }
};

struct MaterialVolume {
  MaterialId material = 0;
  double volume = 0;  ///< of the lowest layer from z = 0
  double area = 0;    ///< of its upper surface, also where others lie on it
};

struct Metrology {
  double highest = 0;  ///< of the surface that gas from the source can reach
  double lowest = 0;
  std::optional<double> lowest_error{};       ///< the largest of the depths of openings
  std::optional<double> surface_roughness{};  ///< where there is no opening
  std::vector<OpeningMetrology> openings{};   ///< by their numbers
  OpeningNames names{};
  std::vector<VoidMetrology> voids{};  ///< the largest first
  std::vector<MaterialVolume> volumes{};
};

/// Measures a stack; with what was measured of its start also what has become less.
///
/// Openings keep the numbers that they have among those known from earlier; where none are known,
/// those of the start. The same to the last bit for any number of threads.
/// Cost: as extract_surface of every layer, and for trenches up to 64 cross-sections of each.
Metrology measure(const Layers& layers, const MetrologyOptions& options = {},
                  const Metrology* start = nullptr, const OpeningNames& known = {});

}  // namespace scarp
