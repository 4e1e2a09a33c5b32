#include "apps/simulator/coverage_cycle.h"

#include <algorithm>
#include <utility>

#include "flux/sampling/portable_math.h"

namespace scarp {

namespace {

// Steps of the first phase begin with this part of it; they grow or shrink at once.
constexpr double first_part = 1.0 / 16;
constexpr double safety = 0.9;
constexpr double most_growth = 3;
constexpr double most_shrinkage = 0.2;

}  // namespace

CoverageCycle::CoverageCycle(const CycledCoverages& model, const TriMesh& facets,
                             const CoverageOptions& options)
    : model_(model),
      options_(options),
      materials_(facets.materials),
      normals_(facet_normals(facets)),
      phases_(model.phases()) {}

StickingFeedback CoverageCycle::feedback() {
  StickingFeedback feedback;
  feedback.species = species_by_coverage(model_, {.material = materials_, .normal = normals_});
  feedback.update = [this](auto flux, auto& sticking) { return update(flux, sticking); };
  feedback.tolerance = flux_tolerance(options_);
  return feedback;
}

// Solutions come one by one: at the bare surface, then at what each step is foretold to end with.
bool CoverageCycle::update(std::span<const std::span<const float>> flux,
                           std::vector<std::vector<float>>& sticking) {
  if (waits_ == Waits::for_call) {
    begin();
    waits_ = Waits::for_bare_flux;
  } else {
    Tallies arrived;
    for (const auto& tally : flux) arrived.emplace_back(tally.begin(), tally.end());
    ++fit_.iterations;
    ++solutions_;
    if (waits_ == Waits::for_bare_flux) {
      known_flux_ = std::move(arrived);
      waits_ = Waits::for_step;
    } else if (correct(arrived)) {
      flux_before_ = std::exchange(known_flux_, std::move(arrived));
      if (left_ == 0 && ++phase_ < phases_.size()) {
        left_ = phases_[phase_];
        last_step_ = 0;
      }
    }
    if (phase_ == phases_.size()) {
      coverages_ = start_;
      waits_ = Waits::for_call;
      return false;
    }
    predict();
  }
  set_covered_sticking(model_, {.material = materials_, .normal = normals_}, coverages_, sticking);
  return true;
}

void CoverageCycle::begin() {
  coverages_.assign(model_.coverage_names().size(), std::vector<float>(materials_.size()));
  start_ = coverages_;
  phase_ = 0;
  left_ = phases_.front();
  wanted_step_ = first_part * left_;
  last_step_ = 0;
  solutions_ = 0;
  fit_.change = 0;
  fit_.reached = true;
}

// The number of solutions is limited: what is left has to fit in if steps grow evenly from here on.
double CoverageCycle::least_step() const {
  const auto phases_left = static_cast<double>(phases_.size() - phase_);
  const double steps_left = std::max(1, options_.most_iterations - solutions_) / phases_left;
  return left_ / std::max(1.0, 0.5 * steps_left * steps_left);
}

// The flux as it was, or, where a step lies behind it, on as it went.
void CoverageCycle::predict() {
  step_ = std::max(wanted_step_, least_step());
  if (step_ >= left_) {
    step_ = left_;
  } else if (step_ > 0.5 * left_) {
    step_ = 0.5 * left_;
  }
  const double onward = last_step_ > 0 ? 0.5 * step_ / last_step_ : 0;
  coverages_ = after_step(onward > 0 ? mean_flux(flux_before_, -onward) : known_flux_);
}

// The flux at the beginning of the step with a part of its difference to another.
CoverageCycle::Tallies CoverageCycle::mean_flux(const Tallies& other, double part) const {
  Tallies mean = known_flux_;
  for (std::size_t t = 0; t < mean.size(); ++t) {
    for (std::size_t f = 0; f < mean[t].size(); ++f) {
      const double value = mean[t][f] + part * (static_cast<double>(other[t][f]) - mean[t][f]);
      mean[t][f] = static_cast<float>(std::max(0.0, value));
    }
  }
  return mean;
}

std::vector<std::vector<float>> CoverageCycle::after_step(const Tallies& flux) const {
  const std::vector<std::span<const float>> views(flux.begin(), flux.end());
  return model_.coverages_after(
      step_, phase_, {.material = materials_, .normal = normals_, .coverages = start_}, views);
}

// Whether the step is good enough; then it is done.
bool CoverageCycle::correct(const Tallies& arrived) {
  std::vector<std::vector<float>> corrected = after_step(mean_flux(arrived, 0.5));
  const CoverageChange change = largest_change(coverages_, corrected);
  // With h and h' this step and the one before, terms of third order in the time are left: the
  // flux foretold errs by h^2 (2 h + 3 h') / 12, corrected by h^3 / 12, of opposite sign. Without a
  // step before, the difference is of second order and stands for itself.
  const double of_difference = last_step_ > 0 ? 1 / (3 + 3 * last_step_ / step_) : 1;
  const int order = last_step_ > 0 ? 3 : 2;
  const double error = of_difference * change.size;
  const bool is_good = error <= options_.tolerance;
  const double ratio = std::clamp(options_.tolerance / std::max(error, 1e-30), 1e-3, 1e3);
  const double factor = safety * portable_power(ratio, 1.0 / order);
  wanted_step_ = step_ * std::clamp(factor, most_shrinkage, most_growth);
  if (!is_good && step_ > least_step()) return false;
  if (error > fit_.change) {
    fit_.change = error;
    fit_.facet = change.facet;
  }
  fit_.reached = fit_.reached && is_good;
  start_ = std::move(corrected);
  last_step_ = step_;
  left_ = step_ == left_ ? 0 : left_ - step_;
  return true;
}

}  // namespace scarp
