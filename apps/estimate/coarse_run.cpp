#include "apps/estimate/coarse_run.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <span>

#include "levelset/surface/resample.h"

namespace scarp {

namespace {

// A few seconds, as the first time step tells; surfaces grow.
constexpr double most_work = 5e6;
constexpr double most_growth = 2;
constexpr double work_per_facet = 10;
constexpr std::uint64_t ray_count = 1 << 12;
constexpr int coarsest = 8;

// A surface has fewer facets, and moves by more in a time step.
int coarsening(const Frame& frame, double work) {
  const double wanted = std::pow(work / most_work, 1.0 / (1 + frame.lateral_axes()));
  int factor = 1;
  for (int k = 2; k <= coarsest && factor < wanted; ++k)
    if (divides(k, frame)) factor = k;
  return factor;
}

Frame coarser(Frame frame, int factor) {
  frame.spacing *= factor;
  for (int axis = 0; axis < frame.lateral_axes(); ++axis) frame.cells[axis] /= factor;
  return frame;
}

// Voids are found anew.
State on_grid(const State& state, const Frame& frame) {
  State moved = copy_of(state);
  if (frame != state.layers.frame) moved.layers = resampled(state.layers, frame);
  moved.voids.clear();
  return moved;
}

}  // namespace

bool divides(int factor, const Frame& frame) {
  const auto cells = std::span(frame.cells).first(static_cast<std::size_t>(frame.lateral_axes()));
  return std::ranges::all_of(cells,
                             [&](int count) { return count % factor == 0 && count / factor >= 2; });
}

Recipe coarser(Recipe recipe, int factor) {
  Frame& frame = recipe.domain.frame;
  frame = coarser(frame, factor);
  FluxPlan& flux = recipe.flux;
  flux.options.sides = frame.sides();
  flux.options.spacing = frame.spacing;
  flux.keep_mesh_within *= factor;
  flux.carry_within *= factor;
  flux.position_error *= factor;
  if (!recipe.simplification.options) return recipe;
  SimplifyOptions& simplify = *recipe.simplification.options;
  simplify.sides = frame.sides();
  simplify.spacing = frame.spacing;
  simplify.l_max *= factor;
  for (auto* length : {&simplify.l0, &simplify.step_length, &simplify.max_error})
    if (*length) **length *= factor;
  simplify.curvature_threshold /= factor;
  return recipe;
}

Recipe with_few_rays(Recipe recipe, std::uint64_t count) {
  FluxOptions& options = recipe.flux.options;
  if (options.rays > 0) options.rays = std::min(options.rays, count);
  options.max_rays = std::min(options.max_rays, count);
  return recipe;
}

double area_of(const Survey& survey, const Frame& frame) {
  const std::vector<double> areas = facet_areas(survey.facets);
  return std::accumulate(areas.begin(), areas.end(), 0.0) / frame.sides().area();
}

double CoarseRun::work(const Survey& survey) {
  double work = work_per_facet * static_cast<double>(survey.facets_full);
  for (const FluxField& flux : survey.flux) work += static_cast<double>(flux.segments);
  return work;
}

CoarseRun::CoarseRun(const Recipe& recipe, const State& start, double work)
    : frame_(recipe.domain.frame),
      coarse_(coarser(with_few_rays(recipe, ray_count), coarsening(frame_, work))),
      state_(on_grid(start, coarse_.domain.frame)),
      work_left_(most_growth * most_work) {}

bool CoarseRun::reach(std::size_t step) {
  while (state_.step < step) {
    if (work_left_ <= 0) return false;
    begin_step(state_, coarse_.steps);
    const Survey now = survey(state_, coarse_);
    note_voids(state_, now.gas);
    work_left_ -= work(now);
    // Steps that were skipped begin, and end, as the next one does.
    areas_.resize(state_.step + 1, area_of(now, coarse_.domain.frame));
    advance(state_, coarse_, now, std::numeric_limits<double>::infinity());
  }
  return true;
}

State CoarseRun::state() const { return on_grid(state_, frame_); }

}  // namespace scarp
