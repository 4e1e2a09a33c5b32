#include "flux/engines/kept_hits.h"

#include <algorithm>

namespace scarp {

namespace {

// Two chemistries by turns with two patterns each, in up to four rounds.
constexpr std::size_t most_views = 16;

// Whether a view is what the rays of a plan see.
bool sends(const View& view, const RayPlan& plan) {
  return std::ranges::equal(view.matrix.first, plan.first(),
                            [](auto rays, auto of_set) { return rays == of_set * set_count; });
}

}  // namespace

bool can_keep_hits(const Species& species) {
  const SourceLobe& source = species.source;
  if (species.ions) return false;
  if (source.kind == SourceLobe::Kind::none) return true;
  return source.is_upright() && source.is_lambert() && source.map.empty();
}

std::shared_ptr<const View> KeptHits::look(std::span<const FluxProblem> problems,
                                           const RayPlan& plan, std::span<const float> widths,
                                           std::shared_ptr<const View> earlier) {
  const auto send = [&] {
    sent_ += plan.total() - earlier->matrix.rays.size();
    return std::make_shared<const View>(scarp::look(problems, plan, *earlier));
  };
  const auto can_keep = [](const FluxProblem& each) { return can_keep_hits(each.species); };
  if (!std::ranges::all_of(problems, can_keep)) return send();
  Known now{.materials = problems.front().mesh.materials,
            .have_source = {},
            .widths = {widths.begin(), widths.end()},
            .view = nullptr};
  for (const FluxProblem& problem : problems) now.have_source.push_back(problem.has_source());
  const auto found = std::ranges::find_if(known_, [&](const Known& known) {
    return known.widths == now.widths && known.have_source == now.have_source &&
           known.materials == now.materials && sends(*known.view, plan);
  });
  if (found == known_.end()) {
    now.view = send();
    if (known_.size() == most_views) known_.pop_front();
    known_.push_back(now);
    return now.view;
  }
  return found->view;
}

}  // namespace scarp
