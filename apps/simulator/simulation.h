// A public header: installed as scarp/simulation.h.
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "core/error.h"
#include "core/recipe/recipe_source.h"
#include "core/tri_mesh.h"
#include "core/vec3.h"
#include "levelset/metrology/cross_section.h"
#include "levelset/metrology/metrology.h"

namespace scarp {

class Simulation;
struct Move;
struct Recipe;
struct State;
struct Survey;
struct VoidChanges;

struct SimulationOptions {
  int threads = 0;                      ///< that compute at once; 0 for all that there are
  const Simulation* start = nullptr;    ///< in place of the state that `start` in the recipe names
  std::filesystem::path resume_from{};  ///< a state that save() wrote, of the same recipe
};

/// What arrives on the facets of a surface. Units: 1e15 cm^-2 s^-1, or 1 where the recipe gives no
/// flux: then 1 arrives on an open wafer.
struct SurfaceFlux {
  std::string species;
  std::vector<float> mean;
  std::vector<float> std_error;
};

/// The surface that the source sees, as the flux was solved on it.
///
/// Shape: materials, fluxes and speeds have an entry per triangle of the mesh; materials[m] is a
///        place in Simulation::materials(). Units: nm, nm/s along the outward normal.
struct Surface {
  TriMesh mesh;
  std::vector<SurfaceFlux> fluxes;
  std::vector<float> speeds;
};

/// phi of a material and all that lies below it, < 0 in the solid.
///
/// Shape: node (i, j, k) is phi[(k * counts[1] + j) * counts[0] + i]; a cross-section has two
/// planes
///        of nodes along y. Units: nm; nodes further than four spacings from the surface have that
///        distance.
struct LevelSetValues {
  std::string material;
  Vec3d origin;  ///< of node (0, 0, 0)
  double spacing = 0;
  std::array<int, 3> counts{};
  std::vector<float> phi;
};

/// The outline of a material and all that lies below it in an upright plane. Units: nm.
struct SectionOutline {
  std::string material;
  std::vector<Polyline> lines;
};

/// A recipe that runs in memory: nothing is printed, no signal is handled, and there may be any
/// number of them at once, in any number of threads. What one computes depends on its recipe alone,
/// not on the number of threads.
///
/// Throws: InputError where recipe, options or arguments are wrong (see InputError::problems()),
///         NumericalError where the simulation cannot go on: not from this state, which may be
///         half of the next one, but from one that was saved.
class Simulation {
 public:
  /// Told after every time step; false stops there.
  using Progress = std::function<bool(const Simulation&)>;

  explicit Simulation(const RecipeSource& source, const SimulationOptions& options = {});
  /// For folders of results: a recipe as it runs (see on_part()), and where it goes on.
  Simulation(Recipe recipe, std::optional<State> resumed);
  ~Simulation();
  Simulation(Simulation&&) noexcept;
  Simulation& operator=(Simulation&&) noexcept;

  /// Go on to the end of the recipe, a process time in s that is not over yet, or the next output
  /// that the recipe asks for, which the end of a step is, too. False if progress stopped it
  /// before.
  bool run_to_end(const Progress& progress = {});
  bool run_to(double time, const Progress& progress = {});
  bool run_to_next_output(const Progress& progress = {});

  bool is_finished() const;
  double time() const;              ///< process time, s
  std::uint32_t time_step() const;  ///< how many are done, those before a start included
  std::size_t step() const;         ///< of the recipe, with repeats written out
  const std::string& step_name() const;
  const std::vector<std::string>& warnings() const;  ///< of the recipe
  const std::string& resolved() const;               ///< the recipe with all defaults written out
  std::vector<std::string> materials() const;

  /// The surface now, of the whole wafer; valid until the simulation goes on.
  const Surface& surface();
  /// The layers, bottom up, of the whole wafer.
  std::vector<LevelSetValues> level_sets() const;
  /// Where a plane cuts the layers, bottom up: "y = 0 nm", "from 0 um, 0 um to 1 um, 1 um".
  std::vector<SectionOutline> section(std::string_view line) const;
  /// As metrology of a run: openings keep their numbers from call to call, and in a state that is
  /// saved.
  const Metrology& metrology();

  /// Writes a state that `start` of a recipe, SimulationOptions::resume_from and scarp's commands
  /// read. The file appears whole or not at all.
  void save(const std::filesystem::path& file) const;
  /// By which runs are compared: the same for the same bits of layers, coverages and time.
  std::string state_hash() const;

  // What is behind it, for scarp's own programs.

  const Recipe& recipe() const;
  const State& state() const;
  /// Of the state now, whose flux is solved where that is not done yet.
  const Survey& survey();
  /// The last one, after advance() of the state before.
  const Survey& last_survey() const;
  /// How closed voids changed between the two last surveys.
  const VoidChanges& void_changes() const;
  /// One time step, at most to a process time in s.
  Move advance(double time_limit);

 private:
  struct Inside;

  bool run_while(const std::function<double()>& limit, const Progress& progress);

  std::unique_ptr<Inside> inside_;
};

}  // namespace scarp
