#include "flux/engines/gather.h"

#include <algorithm>
#include <cmath>
#include <deque>
#include <memory>
#include <numbers>
#include <numeric>
#include <optional>

#include "flux/engines/gathered.h"
#include "flux/engines/kept_hits.h"
#include "flux/engines/view.h"
#include "flux/sampling/portable_math.h"

namespace scarp {

namespace {

// What the first round sends, on average: deep down too few rays say nothing of use.
constexpr double first_rays_per_element = 8;
constexpr double first_rays_per_deep_element = 16;

// Of the cells in which elements are joined, in spacings: from the first one half of it where what
// their size leaves is more than this part of the target. A fixed number of rays has no target.
constexpr float cell_of_fixed_rays = 2;
constexpr float narrowest_cell = 1;
constexpr double most_bias = 1.0 / 3;

// What lies deep down is known by so many elements or more, where its facets are small enough.
constexpr std::uint32_t fewest_deep_elements = 32;

constexpr double mean_tolerance = 1e-7;

// What the error needs.
constexpr double rough_tolerance = 1e-4;

double square(double x) { return x * x; }

// The fluxes that the rays of a round tell, unless a few draws say that the target is missed.
struct Round {
  std::vector<FluxField> fields{};  ///< none if it is
  double error = 0;                 ///< the largest of all problems
  double bias = 0;
  std::vector<float> biases{};      ///< by facet
  std::vector<double> densities{};  ///< of rays, by window, for the fewest in all
};

// With variance s / n^1.5 of an element of area A that sends n rays, the sum of areas times
// variances is least for a given number of rays where n goes as (s A)^0.4. In steps, so that fluxes
// that differ little have the same rays.
std::vector<double> densities_for(const RayPlan& plan, std::span<const double> variances) {
  constexpr double most = 4;
  const auto windows = plan.windows();
  std::vector<double> densities(windows.size());
  double rays = 0;
  double area = 0;
  for (std::size_t w = 0; w < windows.size(); ++w) {
    double of_window = 0;
    const std::uint32_t begin = windows[w].front().begin;
    const std::uint32_t end = windows[w].back().end;
    for (std::uint32_t rank = begin; rank < end; ++rank)
      of_window += plan.elements().area(plan.element_at(rank));
    const double of_element = of_window / (end - begin);
    densities[w] = portable_power(variances[w] * of_element, 0.4) / of_element;
    rays += densities[w] * of_window;
    area += of_window;
  }
  for (double& density : densities) {
    if (rays > 0) density *= area / rays;
    density = std::ldexp(1, std::ilogb(std::numbers::sqrt2 * std::clamp(density, 1 / most, most)));
  }
  return densities;
}

bool any_emits(std::span<const FluxProblem> problems) {
  return std::ranges::any_of(problems,
                             [](const FluxProblem& p) { return !p.species.emission.empty(); });
}

// The elements of some problems, their rays and what these see.
class Gathering {
 public:
  /// hits: nothing, or what rays met before. widths: see elements_of().
  Gathering(std::span<const FluxProblem> problems, const Settle& settle, KeptHits* hits,
            std::vector<float> widths);

  /// Nothing if some elements are too wide for the target.
  std::optional<std::vector<FluxField>> solve();
  /// After that: narrower ones in their places.
  const std::vector<float>& widths() const { return widths_; }

 private:
  // Whether cells and densities of rays follow what is found, to a target.
  bool is_graded() const {
    return !widths_.empty() && options_.joins_facets() && options_.rays == 0;
  }
  void plan_first_rays();
  void halve_cells_of(std::uint32_t element, std::vector<float>& widths) const;
  bool take_widths(std::vector<float> widths);
  bool narrow(std::span<const float> biases, double bias);
  bool narrow_strips();
  bool narrow_small_floors();
  bool narrow_after(const Round& round);
  void grow(double error);
  void look();
  Round solve_round();
  void settle_sticking();

  std::span<const FluxProblem> problems_;
  const FluxOptions& options_;
  const Settle& settle_;
  KeptHits* const hits_;
  std::vector<float> widths_;
  Elements elements_;
  FacetValues values_;
  RayPlan plan_;
  RayLimit limit_{};
  double rays_ = 0;
  bool is_last_;
  std::shared_ptr<const View> view_;
};

Gathering::Gathering(std::span<const FluxProblem> problems, const Settle& settle, KeptHits* hits,
                     std::vector<float> widths)
    : problems_(problems),
      options_(problems.front().options),
      settle_(settle),
      hits_(hits),
      widths_(std::move(widths)),
      elements_(elements_of(problems.front(), widths_)),
      values_(problems.front().mesh, elements_),
      plan_(problems.front().scene, elements_, 2,
            std::ranges::any_of(problems, is_looked_for) ? least_group_of_halves : 1),
      is_last_(options_.rays > 0) {}

void Gathering::plan_first_rays() {
  const std::uint64_t scouts = widths_.empty() ? 0 : aim_at_sky(problems_.front(), plan_);
  limit_ = ray_limit(options_, plan_.least_total(),
                     sizeof(ExchangeMatrix::Ray) + sizeof(ExchangeRows::Seen) + 2 * sizeof(Vec3f));
  view_ = std::make_shared<const View>(View{.flights = scouts});
  rays_ = static_cast<double>(limit_.rays);
  if (options_.rays == 0) {
    double first = 0;
    for (std::size_t rank = 0; rank < plan_.size(); ++rank)
      first +=
          plan_.block_of(rank).aims_at_sky ? first_rays_per_deep_element : first_rays_per_element;
    rays_ = std::min(rays_, std::max(first, double{least_rays}));
  }
  plan_.grow(rays_ / plan_.surface(), limit_.rays);
}

void Gathering::settle_sticking() {
  std::vector<std::vector<double>> flux(problems_.size());
  std::vector<std::vector<float>> arrivals(problems_.size());
  do {
    for (std::size_t p = 0; p < problems_.size(); ++p) {
      ElementFlux of_elements(problems_[p], p, plan_, values_, *view_);
      of_elements.solve(settle_.tolerance, flux[p]);
      flux[p].assign(of_elements.by_rank().begin(), of_elements.by_rank().end());
      arrivals[p] = of_elements.on_facets().of_all();
    }
  } while (settle_.update(arrivals));
}

Round Gathering::solve_round() {
  std::deque<Gathered> all;
  const auto begin_next = [&] {
    const std::size_t p = all.size();
    all.emplace_back(problems_[p], p, plan_, values_, *view_,
                     is_last_ ? mean_tolerance : rough_tolerance);
  };
  if (settle_.passed_on) {
    std::vector<std::vector<float>> arrivals;
    while (all.size() < problems_.size()) {
      begin_next();
      arrivals.push_back(all.back().arrivals());
    }
    const std::vector<std::vector<float>> passed_on = settle_.passed_on(arrivals);
    for (std::size_t p = 0; p < all.size(); ++p) all[p].pass_on_errors_by(passed_on[p]);
  }
  Round round;
  round.biases.resize(values_.facet_count());
  std::vector<double> variances(plan_.windows().size());
  for (std::size_t p = 0; p < problems_.size(); ++p) {
    if (p == all.size()) begin_next();
    if (is_graded()) {
      all[p].add_variances(variances);
      const std::vector<float> biases = all[p].biases();
      round.bias = std::max(round.bias, all[p].bias_measure(biases));
      std::ranges::transform(biases, round.biases, round.biases.begin(),
                             [](float a, float b) { return std::max(a, b); });
    }
    if (is_last_) continue;
    all[p].draw(FluxDraws::at_once);
    round.error = std::max(round.error, all[p].target_measure());
  }
  if (is_graded()) round.densities = densities_for(plan_, variances);
  if (round.error > options_.target_error && !is_last_) return round;
  for (Gathered& gathered : all) {
    if (!is_last_) gathered.solve(mean_tolerance);
    gathered.draw(draw_count);
    round.fields.push_back(gathered.field());
    const double measure = round.fields.back().target_measure();
    round.error = std::max(round.error, measure);
    if (options_.rays == 0 && measure > options_.target_error)
      round.fields.back().missed_by = plan_.is_full() ? RayCap::elements : limit_.cap;
  }
  return round;
}

// How many times as many rays the next round has. The error of scrambled sets was seen to fall as
// n^-0.83 with their number; a few more make another round unlikely. Rays go on where they were, so
// that rounds on the way waste only their solves.
double growth_for(double error, double target) {
  constexpr double aim = 0.97;  // of the target
  return std::clamp(portable_power(error / (aim * target), 1.2), 1.1, 3.0);
}

void Gathering::grow(double error) {
  const double growth = growth_for(error, options_.target_error);
  for (const std::uint64_t total = plan_.total(); plan_.total() == total && !is_last_;) {
    rays_ *= growth;
    is_last_ = rays_ >= static_cast<double>(limit_.rays);
    plan_.grow(rays_ / plan_.surface(), limit_.rays);
  }
}

void Gathering::look() {
  view_ = hits_ != nullptr ? hits_->look(problems_, plan_, widths_, view_)
                           : std::make_shared<const View>(scarp::look(problems_, plan_, *view_));
}

// An element is narrowed as a whole.
//
// Shape: one width per facet.
void Gathering::halve_cells_of(std::uint32_t element, std::vector<float>& widths) const {
  for (const std::uint32_t p : elements_.pieces_of(element)) {
    const std::uint32_t f = elements_.piece(p).facet;
    widths[f] = std::max(widths_[f] / 2, narrowest_cell);
  }
}

// Whether any of them is another one.
bool Gathering::take_widths(std::vector<float> widths) {
  std::swap(widths, widths_);
  return widths != widths_;
}

// Halves the cells of the elements with the largest biases, all together so far that bias, what
// these make, comes down to half of what may be left.
//
// Shape: one bias per facet.
bool Gathering::narrow(std::span<const float> biases, double bias) {
  std::vector<double> squares(elements_.count());
  for (std::uint32_t e = 0; e < squares.size(); ++e)
    for (const std::uint32_t p : elements_.pieces_of(e))
      squares[e] += elements_.piece(p).area * square(biases[elements_.piece(p).facet]);
  std::vector<std::uint32_t> order(squares.size());
  std::iota(order.begin(), order.end(), 0U);
  std::ranges::sort(order, [&](std::uint32_t a, std::uint32_t b) {
    return squares[a] != squares[b] ? squares[a] > squares[b] : a < b;
  });
  double rest = std::accumulate(squares.begin(), squares.end(), 0.0);
  const double left = rest * square(0.5 * most_bias * options_.target_error / bias);
  std::vector<float> widths = widths_;
  for (std::size_t k = 0; k < order.size() && rest > left; rest -= squares[order[k++]])
    halve_cells_of(order[k], widths);
  return take_widths(std::move(widths));
}

// Before any ray is sent: what makes a bias by itself, wherever flux arrives.
bool Gathering::narrow_strips() {
  if (!is_graded() || !options_.responses.empty()) return false;
  const RayScene& scene = problems_.front().scene;
  std::vector<float> biases;
  double squares = 0;
  double area = 0;
  for (std::size_t f = 0; f < values_.facet_count(); ++f) {
    biases.push_back(static_cast<float>(facet_bias_counts * values_.off_in_strips(f)));
    squares += scene.area(f) * square(biases[f]);
    area += scene.area(f);
  }
  const double bias = std::sqrt(squares / area);
  return bias > most_bias * options_.target_error && narrow(biases, bias);
}

// Before any ray is sent: few rays find a strong source from deep down, and of what nine elements
// find there errors follow that are a tenth too small.
bool Gathering::narrow_small_floors() {
  if (!is_graded()) return false;
  std::vector<float> widths = widths_;
  for (const RayPlan::Window& window : plan_.windows()) {
    const std::uint32_t begin = window.front().begin;
    const std::uint32_t end = window.back().end;
    if (!window.front().aims_at_sky || end - begin >= fewest_deep_elements) continue;
    for (std::uint32_t rank = begin; rank < end; ++rank)
      halve_cells_of(plan_.element_at(rank), widths);
  }
  return take_widths(std::move(widths));
}

// Long before the error has come down to what their size leaves, that is as well known as later.
bool Gathering::narrow_after(const Round& round) {
  constexpr double soon = 10;
  if (!is_graded()) return false;
  const bool is_biased = round.bias > most_bias * options_.target_error;
  return is_biased && round.error < soon * round.bias && narrow(round.biases, round.bias);
}

std::optional<std::vector<FluxField>> Gathering::solve() {
  if (narrow_strips()) return std::nullopt;
  plan_first_rays();
  if (narrow_small_floors()) return std::nullopt;
  for (bool is_first = true;; is_first = false) {
    look();
    const bool settles_at_once = settle_.update && (is_first || is_last_);
    if (settles_at_once) settle_sticking();
    Round round = solve_round();
    if (settle_.update && !settles_at_once && round.error <= options_.target_error) {
      settle_sticking();
      round = solve_round();
    }
    if (narrow_after(round)) return std::nullopt;
    if (is_last_ || round.error <= options_.target_error) return std::move(round.fields);
    // Borders of shadows in a narrow lobe, and what a few facets emit, the few rays of a first
    // round find by chance.
    if (is_first && is_graded() && !any_emits(problems_)) plan_.weigh(round.densities);
    grow(round.error);
  }
}

// Next to what emits facets may emit nothing.
float first_width(std::span<const FluxProblem> problems) {
  if (problems.front().options.rays > 0) return cell_of_fixed_rays;
  return any_emits(problems) ? narrowest_cell : widest_cell;
}

}  // namespace

// Shadows in a narrow lobe may be sharper than a joined element. In two dimensions an element has
// no neighbours aside that its noise would average with, and rays are cheap.
std::vector<FluxField> gather(std::span<const FluxProblem> problems, const Settle& settle,
                              KeptHits* hits) {
  if (problems.empty()) return {};
  std::vector<float> widths;
  if (std::ranges::none_of(problems, is_looked_for))
    widths.assign(problems.front().scene.facet_count(), first_width(problems));
  for (;;) {
    Gathering gathering(problems, settle, hits, std::move(widths));
    if (auto fields = gathering.solve()) return std::move(*fields);
    widths = gathering.widths();
  }
}

}  // namespace scarp
