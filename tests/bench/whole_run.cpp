#include "tests/bench/whole_run.h"

#include "apps/simulator/simulator.h"
#include "apps/simulator/symmetry.h"
#include "levelset/surface/extract_surface.h"
#include "mesh/distance.h"
#include "tests/bench/cpu_time.h"

namespace scarp::bench {

namespace {

// Stages have wall times. The CPU time of a call is split by them: what other programs take of the
// processor lengthens all stages of the call alike, on average.
void add_stages(const StageTimer& wall, double cpu, StageTimer& stages) {
  double sum = 0;
  for (const auto& [stage, seconds] : wall.stages()) sum += seconds;
  if (sum == 0) return;
  for (const auto& [stage, seconds] : wall.stages()) stages.add(stage, cpu * seconds / sum);
}

Recipe on_its_part(const Recipe& recipe) {
  return on_part(recipe, recipe.domain.uses_symmetry ? mirror_planes(recipe) : FoundPlanes{});
}

}  // namespace

WholeRun run_to_end(const Recipe& given) {
  const Recipe recipe = on_its_part(given);
  State state = start_state(recipe.domain.frame, recipe.start);
  WholeRun run;
  const auto timed = [&](const auto& call) {
    const double start = cpu_seconds();
    auto result = call();
    const double cpu = cpu_seconds() - start;
    run.cpu_seconds += cpu;
    add_stages(result.timer, cpu, run.stages);
    return result;
  };
  for (; !finished(state, recipe.steps); ++run.time_steps) {
    begin_step(state, recipe.steps);
    const Survey now = timed([&] { return survey(state, recipe); });
    note_voids(state, now.gas);
    run.facets += static_cast<double>(now.facets.triangles.size());
    for (const FluxField& flux : now.flux) run.rays += static_cast<double>(flux.rays);
    timed([&] { return advance(state, recipe, now, next_output(state, recipe.outputs.every)); });
  }
  run.facets /= static_cast<double>(run.time_steps);
  const State whole = whole_of(std::move(state));
  run.surface = extract_surface(whole.layers, open_gas(whole.layers));
  return run;
}

double distance_between(const TriMesh& a, const TriMesh& b, double spacing) {
  const SurfaceDistance distance = surface_distance(a, b, spacing);
  return (distance.forward.mean + distance.reverse.mean) / (2 * spacing);
}

}  // namespace scarp::bench
