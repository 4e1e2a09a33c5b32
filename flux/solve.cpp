#include "flux/solve.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>

#include "core/error.h"
#include "flux/engines/beam.h"
#include "flux/engines/forward.h"
#include "flux/engines/gather.h"
#include "flux/engines/gather_forward.h"
#include "flux/rays/patches.h"
#include "flux/rays/ray_scene.h"
#include "flux/revolution.h"

namespace scarp {

namespace {

void check(bool valid, const std::string& message) {
  if (!valid) throw InputError(message);
}

void check_options(const FluxOptions& options) {
  for (int axis = 0; axis < 2; ++axis) {
    check(std::isfinite(options.sides.width(axis)) && options.sides.width(axis) > 0,
          std::string("flux: the domain has no width along ") + (axis == 0 ? "x" : "y") +
              "; the mesh has to cover an area seen from above");
  }
  check(std::isfinite(options.spacing) && options.spacing >= 0,
        "flux: spacing has to be a positive length");
  check(options.rays > 0 || (std::isfinite(options.target_error) && options.target_error > 0),
        "flux.target_error: " + std::to_string(options.target_error) +
            " is not allowed; write a number above 0, for example 0.01");
  check(options.rays > 0 || options.max_rays > 0, "flux.max_rays: 0 rays give no flux");
  check(options.rays <= most_rays && options.max_rays <= most_rays,
        "flux: more than 2^32 rays are not allowed");
}

void check_beam(const Species& species, const FluxOptions& options) {
  const Vec3d d = species.source.direction;
  const double norm = length(d);
  const std::string where = "species " + species.name + ": ";
  check(std::isfinite(norm) && norm > 0 && d.z < 0,
        where + "the direction of a beam has to point down to the wafer");
  check(species.source.map.empty(), where + "a beam comes evenly from everywhere, without a map");
  for (int axis = 0; axis < 2; ++axis) {
    const bool tilted = std::abs(d[axis]) > 1e-12 * norm;
    check(!tilted || axis < options.lateral_axes(),
          where + "in two dimensions a beam has to lie in the cross-section");
  }
  for (const float s : species.sticking)
    check(s == 1, where + "a beam is not followed after it arrives, so its sticking has to be 1");
}

// The exchange knows diffuse re-emission under a source that is the same all around.
bool needs_particles(const Species& species) {
  const bool leans = !species.source.is_upright();
  return species.ions || (leans && species.source.kind != SourceLobe::Kind::none);
}

void check_ions(const Species& species, const std::string& where) {
  const Ions& ions = *species.ions;
  check(ions.sticking.least() >= 0 && ions.sticking.largest() <= 1,
        where + "the sticking of ions leaves [0, 1] at some angle");
  check(ions.energy_kept.least() >= 0 && ions.energy_kept.largest() <= 1,
        where + "the part of the energy that is kept leaves [0, 1] at some angle");
  check(ions.cone.least() >= 0 && ions.cone.largest() <= std::numbers::pi / 2 + 1e-6,
        where + "the cone of reflection is wider than a half space");
  check(ions.energy_deviation >= 0 && ions.energy_deviation <= 1,
        where + "the deviation of the energy that is kept is outside [0, 1]");
  for (const YieldLaw& law : species.yields) {
    try {
      law.check(ions.energy.largest());
    } catch (const InputError& error) {
      throw InputError(where + "yield " + law.name + " " + error.what());
    }
  }
}

void check_species(const Species& species, const FluxOptions& options) {
  check(!species.name.empty(), "species: a name is missing");
  const std::string where = "species " + species.name + ": ";
  check(!species.sticking.empty(), where + "sticking is missing");
  for (const float s : species.sticking)
    check(s >= 0 && s <= 1, where + "sticking " + std::to_string(s) + " is outside [0, 1]");
  if (species.source.kind == SourceLobe::Kind::beam) return check_beam(species, options);
  const Vec3d axis = species.source.direction;
  check(std::abs(length(axis) - 1) < 1e-9 && axis.z < 0,
        where + "the source has to point down to the wafer");
  check(species.ions || species.yields.empty(), where + "only ions have yields");
  if (species.ions) check_ions(species, where);
  const double power = species.source.cosine_power;
  check(power >= 0 && power <= 1e6,
        where + "cosine power " + std::to_string(power) + " is outside [0, 1e6]");
}

void check_emission(const Species& species, std::size_t facet_count) {
  const std::string where = "species " + species.name + ": ";
  const bool from_above = species.source.kind != SourceLobe::Kind::none;
  check(from_above || !species.emission.empty(),
        where + "it has no source: nothing comes from above and no facet emits");
  if (species.emission.empty()) return;
  check(!species.ions && species.source.kind != SourceLobe::Kind::beam,
        where + "only neutrals can be emitted by facets");
  check(species.emission.size() == facet_count,
        where + "emission has " + std::to_string(species.emission.size()) + " entries for " +
            std::to_string(facet_count) + " facets");
  for (const float emission : species.emission)
    check(emission >= 0 && std::isfinite(emission), where + "emission is negative or not finite");
}

void check_responses(const TriMesh& facets, std::span<const Species> species,
                     const FluxOptions& options) {
  if (options.responses.empty()) return;
  SCARP_ASSERT(options.responses.size(), ==, species.size());
  for (std::size_t index = 0; index < species.size(); ++index) {
    const bool is_beam = species[index].source.kind == SourceLobe::Kind::beam;
    const std::size_t tallies = is_beam ? 2 : 1 + species[index].yields.size();
    SCARP_ASSERT(options.responses[index].size(), ==, tallies);
    for (const std::vector<float>& of_tally : options.responses[index])
      SCARP_ASSERT(of_tally.size(), ==, facets.triangles.size());
  }
}

void check_feedback(std::span<const Species> species, const StickingFeedback& feedback) {
  for (std::size_t index = 0; index < species.size(); ++index) {
    const bool can_be_gathered =
        species[index].source.kind != SourceLobe::Kind::beam && !needs_particles(species[index]);
    check(!feedback.changes(index) || can_be_gathered,
          "species " + species[index].name +
              ": sticking that depends on the flux is that of neutrals from an upright source");
  }
}

std::vector<float> sticking_of_facets(const TriMesh& mesh, const Species& species) {
  std::vector<float> sticking(mesh.triangles.size(), species.sticking.front());
  for (std::size_t f = 0; f < mesh.materials.size(); ++f) {
    check(mesh.materials[f] < species.sticking.size(),
          "species " + species.name + ": sticking of material number " +
              std::to_string(mesh.materials[f]) + " is missing");
    sticking[f] = species.sticking[mesh.materials[f]];
  }
  return sticking;
}

void check_surface_emission(std::span<const Species> species, const SurfaceEmission& emission) {
  for (std::size_t index = 0; index < species.size(); ++index)
    check(!emission.tells(index) || species[index].emission.empty(),
          "species " + species[index].name + ": its emission is given twice");
}

bool is_mirror_image(Vec3d a, Vec3d b, const Sides& sides) {
  for (int axis = 0; axis < 2; ++axis) {
    const bool mirrored = sides.boundary[static_cast<std::size_t>(axis)] == Boundary::reflective;
    const double turned = mirrored ? std::abs(a[axis]) - std::abs(b[axis]) : a[axis] - b[axis];
    if (std::abs(turned) > 1e-12) return false;
  }
  return true;
}

// Between reflective sides a tilted beam falls on the domain from one side only, its mirror images
// from the others: what they bring and what is absorbed balance in the mean of them all.
void balance_mirror_images(std::span<const Species> species, const Sides& sides,
                           std::span<FluxField> fields) {
  std::vector<double> absorbed(fields.size());
  for (std::size_t i = 0; i < fields.size(); ++i) {
    if (fields[i].engine != FluxEngine::beam) continue;
    int images = 0;
    for (std::size_t j = 0; j < fields.size(); ++j) {
      if (fields[j].engine != FluxEngine::beam ||
          !is_mirror_image(normalized(species[i].source.direction),
                           normalized(species[j].source.direction), sides)) {
        continue;
      }
      absorbed[i] += fields[j].audit.absorbed;
      ++images;
    }
    absorbed[i] /= images;
  }
  for (std::size_t i = 0; i < fields.size(); ++i)
    if (fields[i].engine == FluxEngine::beam) fields[i].audit.absorbed = absorbed[i];
}

// In a deep feature rays from the facets hardly ever find the source, while every particle finds a
// facet; the less of them stick, the more flights each makes, and the less the rays have to find.
// Over trenches and holes 1 to 20 times as deep as wide, sticking 0.01 to 1 and errors of 3 and 1 %
// (bench flux --table) the two take as many flights where this product is 0.7 to 1.3; what is
// chosen here takes at most 1.4 times the fewer.
bool particles_are_fewer(const FluxProblem& problem) {
  const FluxOptions& options = problem.options;
  if (options.rays > 0 || !problem.species.source.is_lambert()) return false;
  if (!options.responses.empty()) return false;  // the target is none of the flux
  if (!problem.species.emission.empty()) return false;
  double sticking_area = 0;
  for (std::size_t f = 0; f < problem.sticking.size(); ++f)
    sticking_area += problem.scene.area(f) * static_cast<double>(problem.sticking[f]);
  return sticking_area / problem.scene.source_area() * std::sqrt(options.target_error) > 0.9;
}

// A ray from a facet that meets the source stands for as many particles as it is flat: where many
// come along the wafer, few such rays bring most of what walls receive, and errors fall slowly. In
// a trench deeper than wide, tilted cosine powers of 20 and 100 took 2.5 to 4 times as many flights
// as particles from the source close to the part that is the limit here, 50 to 80 times beyond it.
bool comes_along_wafer(const FluxProblem& problem) {
  constexpr double flat = 0.03;
  return problem.options.rays == 0 && part_below(problem.species.source, flat) > 0.003;
}

// Of what nothing emits: no flux, and no error.
FluxField nothing_arrives(const FluxProblem& problem) {
  FluxField field{.tallies = {estimate(problem.scene, problem.patches,
                                       {.flux = [](std::size_t) { return 0.0; },
                                        .deviations = [](std::size_t, std::span<double>) {},
                                        .count = 0})
                                  .tally}};
  if (!problem.responses().empty()) field.response_error = 0;
  return field;
}

bool is_traced_forward(const FluxProblem& problem) {
  if (problem.options.engine == FluxOptions::Engine::forward) return true;
  const bool is_free = problem.options.engine == FluxOptions::Engine::automatic;
  // What goes on from first arrivals starts where these were found, not on facets that emit.
  if (needs_particles(problem.species))
    return !problem.species.emission.empty() || (is_free && comes_along_wafer(problem));
  return is_free && particles_are_fewer(problem);
}

// All species on one surface, each by the engine that suits it.
class Solver {
 public:
  Solver(const TriMesh& facets, std::span<const Species> species, const FluxOptions& options,
         const StickingFeedback& feedback, const SurfaceEmission& emission, KeptHits* hits);

  std::vector<FluxField> solve();

 private:
  FluxProblem problem(std::size_t index) const {
    return {.mesh = mesh_,
            .scene = scene_,
            .patches = patches_,
            .sticking = sticking_[index],
            .species = species_[index],
            .species_index = static_cast<std::uint32_t>(index),
            .options = options_};
  }
  bool is_gathered(std::size_t index) const;
  void trace(std::size_t index, std::uint64_t least_rays = 0);
  void trace_together(std::span<const std::size_t> indices);
  void gather_together(std::span<const std::size_t> indices, const Settle& settle);
  std::vector<std::span<const float>> flux() const;
  bool fit_sticking();
  std::vector<std::vector<float>> passed_on(std::span<const std::size_t> indices,
                                            std::span<const std::vector<float>> arrivals);
  bool is_solved_last(std::size_t index) const {
    return emission_.tells(index) && !feedback_.changes(index);
  }
  void find_emission(bool last);
  void solve_sources();
  void solve_emitted();

  const TriMesh& mesh_;
  std::vector<Species> species_;
  const FluxOptions& options_;
  const StickingFeedback& feedback_;
  const SurfaceEmission& emission_;
  KeptHits* const hits_;
  RayScene scene_;
  Patches patches_;
  std::vector<std::vector<float>> sticking_;
  std::vector<FluxField> fields_;
};

Solver::Solver(const TriMesh& facets, std::span<const Species> species, const FluxOptions& options,
               const StickingFeedback& feedback, const SurfaceEmission& emission, KeptHits* hits)
    : mesh_(facets),
      species_(species.begin(), species.end()),
      options_(options),
      feedback_(feedback),
      emission_(emission),
      hits_(hits),
      scene_(facets, options.sides,
             options.spacing > 0 ? options.spacing : guessed_spacing(facets)),
      patches_(facets, scene_, options.rings),
      fields_(species.size()) {
  for (const Species& one : species) sticking_.push_back(sticking_of_facets(facets, one));
}

bool Solver::is_gathered(std::size_t index) const {
  if (feedback_.changes(index) && options_.engine != FluxOptions::Engine::forward) return true;
  const bool is_beam = species_[index].source.kind == SourceLobe::Kind::beam;
  const FluxProblem its = problem(index);
  return !is_beam && its.emitted() > 0 && !is_traced_forward(its) &&
         !needs_particles(species_[index]);
}

void Solver::trace(std::size_t index, std::uint64_t least_rays) {
  FluxField& field = fields_[index];
  if (problem(index).emitted() == 0) {
    field = nothing_arrives(problem(index));
  } else if (species_[index].source.kind == SourceLobe::Kind::beam) {
    field = trace_beam(problem(index));
    field.engine = FluxEngine::beam;
  } else if (is_traced_forward(problem(index))) {
    field = trace_forward(problem(index), least_rays);
  } else {
    field = gather_forward(problem(index));
    field.engine = FluxEngine::gather_forward;
  }
}

// Anew for every sticking that they lead to, and never with fewer particles than before: what
// changes then is the sticking's doing.
void Solver::trace_together(std::span<const std::size_t> indices) {
  struct Work {
    std::uint64_t least_rays = 0;
    std::uint64_t rays = 0;  // of all turns
    std::uint64_t segments = 0;
  };
  std::vector<Work> works(species_.size());
  do {
    for (const std::size_t index : indices) {
      FluxField& field = fields_[index];
      Work& work = works[index];
      trace(index, work.least_rays);
      work.least_rays = field.rays;
      field.rays = work.rays += field.rays;
      field.segments = work.segments += field.segments;
    }
  } while (fit_sticking());
}

void Solver::gather_together(std::span<const std::size_t> indices, const Settle& settle) {
  std::vector<FluxProblem> problems;
  problems.reserve(indices.size());
  for (const std::size_t index : indices) problems.push_back(problem(index));
  std::vector<FluxField> from_gather = gather(problems, settle, hits_);
  for (std::size_t k = 0; k < indices.size(); ++k) {
    fields_[indices[k]] = std::move(from_gather[k]);
    fields_[indices[k]].engine = FluxEngine::gather;
  }
}

// Problems refer to sticking and species, which stay where they are and get other numbers.
bool Solver::fit_sticking() {
  const bool changed = feedback_.update(flux(), sticking_);
  if (changed && emission_.of) find_emission(false);
  return changed;
}

// What is re-emitted is a part 1 - s of F that changes with F itself. Species that share
// rays are taken to err by the same part; errors of ions, which are those of single facets,
// are left out. Solvers want parts from 0 to 1, and below the differences' own errors none that is
// exactly 1; where more is taken up than what comes more, by reactions of higher order, nothing is
// passed on.
std::vector<std::vector<float>> Solver::passed_on(std::span<const std::size_t> indices,
                                                  std::span<const std::vector<float>> arrivals) {
  constexpr float little = 0.01F;
  // Fluxes of these species stand in the fields only to be asked about, until they are known.
  const auto sticking_with = [&](float factor) {
    for (std::size_t k = 0; k < indices.size(); ++k)
      std::ranges::transform(arrivals[k], fields_[indices[k]].tallies.front().mean.begin(),
                             [&](float flux) { return factor * flux; });
    return feedback_.sticking_at(flux());
  };
  const std::vector<std::vector<float>> less = sticking_with(1 - little);
  const std::vector<std::vector<float>> more = sticking_with(1 + little);
  std::vector<std::vector<float>> parts;
  for (const std::size_t index : indices) {
    std::vector<float>& part = parts.emplace_back();
    if (!feedback_.changes(index)) continue;
    for (std::size_t f = 0; f < scene_.facet_count(); ++f) {
      const float sticks = sticking_[index][f];
      const float rise = (more[index][f] - less[index][f]) / (2 * little);
      part.push_back(std::clamp(1 - sticks - rise, 0.0F, 1 - little * sticks));
    }
  }
  return parts;
}

std::vector<std::span<const float>> Solver::flux() const {
  std::vector<std::span<const float>> flux;
  for (const FluxField& field : fields_)
    for (const Tally& tally : field.tallies) flux.emplace_back(tally.mean);
  return flux;
}

// Of those that are solved last, or of those that are solved with the sticking.
void Solver::find_emission(bool last) {
  std::vector<std::vector<float>> emission = emission_.of(flux());
  std::size_t next = 0;
  for (std::size_t index = 0; index < species_.size(); ++index) {
    if (!emission_.tells(index)) continue;
    SCARP_ASSERT(next, <, emission.size());
    std::vector<float>& its = emission[next++];
    if (is_solved_last(index) != last) continue;
    species_[index].emission = std::move(its);
    check_emission(species_[index], scene_.facet_count());
  }
}

std::vector<FluxField> Solver::solve() {
  solve_sources();
  if (emission_.of) solve_emitted();
  balance_mirror_images(species_, options_.sides, fields_);
  return std::move(fields_);
}

void Solver::solve_emitted() {
  find_emission(true);
  std::vector<std::size_t> gathered;
  for (std::size_t index = 0; index < species_.size(); ++index) {
    if (!is_solved_last(index)) continue;
    if (is_gathered(index)) {
      gathered.push_back(index);
    } else {
      trace(index);
    }
  }
  gather_together(gathered, {});
}

void Solver::solve_sources() {
  std::vector<std::size_t> gathered;
  std::vector<std::size_t> traced;  // with the sticking
  for (std::size_t index = 0; index < species_.size(); ++index) {
    const bool is_first = !is_solved_last(index) && !is_gathered(index);
    if (is_first && !feedback_.changes(index)) {
      trace(index);
      continue;
    }
    // Until it is solved; see StickingFeedback::update.
    const float arrives = emission_.tells(index) ? 0 : 1;
    fields_[index].tallies = {{.mean = std::vector<float>(scene_.facet_count(), arrives)}};
    if (is_first) {
      traced.push_back(index);
    } else if (!is_solved_last(index)) {
      gathered.push_back(index);
    }
  }
  Settle settle;
  if (feedback_.update) {
    fit_sticking();
    if (!traced.empty()) return trace_together(traced);
    settle.tolerance = feedback_.tolerance;
    settle.update = [&](std::span<const std::vector<float>> arrivals) {
      for (std::size_t k = 0; k < gathered.size(); ++k)
        fields_[gathered[k]].tallies.front().mean = arrivals[k];
      return fit_sticking();
    };
    if (feedback_.sticking_at)
      settle.passed_on = [&](auto arrivals) { return passed_on(gathered, arrivals); };
  }
  gather_together(gathered, settle);
}

}  // namespace

std::vector<FluxField> solve_flux(const TriMesh& facets, std::span<const Species> species,
                                  const FluxOptions& options, const StickingFeedback& feedback,
                                  const SurfaceEmission& emission, KeptHits* hits) {
  check_options(options);
  for (const Species& one : species) check_species(one, options);
  check(!facets.triangles.empty(), "flux: the mesh has no triangles");
  for (std::size_t index = 0; index < species.size(); ++index)
    if (!emission.tells(index)) check_emission(species[index], facets.triangles.size());
  check_responses(facets, species, options);
  check_feedback(species, feedback);
  check_surface_emission(species, emission);
  if (options.axisymmetric)
    return solve_revolved(facets, species, options, feedback, emission, hits);
  return Solver(facets, species, options, feedback, emission, hits).solve();
}

}  // namespace scarp
