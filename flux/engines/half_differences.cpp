#include "flux/engines/half_differences.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "core/parallel.h"

namespace scarp {

namespace {

double square(double x) { return x * x; }

// What one set of an element's rays says about all that it sees.
struct Found {
  double flux = 0;
  double out = 0;
  double lost = 0;
};

using OfParts = std::array<float, set_count * most_parts>;

// How the rays of an element scatter, each about the mean of those that are aimed as it is.
class Scatter {
 public:
  explicit Scatter(bool aims_at_sky) : aims_at_sky_(aims_at_sky) {}

  void add(std::size_t ray, double x) {
    constexpr std::size_t every = RayPlan::rays_per_skyward;
    const bool is_skyward = aims_at_sky_ && ray / set_count % every == every - 1;
    Sums& sums = sums_[is_skyward ? 1 : 0];
    sums.rays += 1;
    sums.sum += x;
    sums.squares += x * x;
  }
  double variance() const {
    double sum = 0;
    double rays = 0;
    for (const Sums& of : sums_) {
      if (of.rays > 1)
        sum += std::max(of.squares - of.sum * of.sum / of.rays, 0.0) * of.rays / (of.rays - 1);
      rays += of.rays;
    }
    return sum / rays;
  }

 private:
  struct Sums {
    double rays = 0;
    double sum = 0;
    double squares = 0;
  };

  bool aims_at_sky_;
  std::array<Sums, 2> sums_{};
};

// Sums over the parts of an element's sets.
class Parts {
 public:
  Parts(std::uint32_t count, std::uint32_t rays, bool aims_at_sky)
      : count_(count), rays_(rays), aims_at_sky_(aims_at_sky) {}

  /// Of rays that follow each other, in turn of the first and the second set.
  void add(std::size_t ray, double x) {
    const auto index = static_cast<std::uint32_t>(ray / set_count);
    sums_[ray % set_count][part_of(index)] += x;
    size_ += std::abs(x);
  }
  /// What their means are more than that of the set.
  OfParts differences() const {
    const double rounding = 1e-6 * size_ / (rays_ * set_count);
    OfParts result{};
    std::array<double, most_parts> rays{};
    for (std::uint32_t index = 0; index < rays_; ++index) rays[part_of(index)] += 1;
    for (std::size_t set = 0; set < set_count; ++set) {
      double mean = 0;
      for (std::size_t part = 0; part < count_; ++part)
        mean += sums_[set][part] / (rays[part] * count_);
      for (std::size_t part = 0; part < count_; ++part) {
        const double more = sums_[set][part] / rays[part] - mean;
        if (std::abs(more) > rounding) result[set * most_parts + part] = static_cast<float>(more);
      }
    }
    return result;
  }

 private:
  // Rays that are aimed at the sky are points of a sequence of their own.
  std::uint32_t part_of(std::uint32_t index) const {
    constexpr std::uint32_t every = RayPlan::rays_per_skyward;
    if (!aims_at_sky_) return index * count_ / rays_;
    const std::uint32_t skyward = rays_ / every;
    if (index % every == every - 1) return index / every * count_ / skyward;
    return (index - index / every) * count_ / (rays_ - skyward);
  }

  std::uint32_t count_;
  std::uint32_t rays_;  // in a set
  bool aims_at_sky_;
  double size_ = 0;  // of all together
  std::array<std::array<double, most_parts>, set_count> sums_{};
};

// The rays of an element.
class Row {
 public:
  Row(const View& view, std::size_t problem, std::size_t row, const Radiosity& radiosity,
      const Parts& parts, bool aims_at_sky)
      : view_(view),
        sums_(view.sums[row]),
        direct_(std::span(view.direct[problem]).subspan(row * set_count, set_count)),
        direct_squares_(view.direct_squares[problem][row]),
        row_(row),
        radiosity_(radiosity),
        of_flux_(parts),
        of_lost_(parts),
        flux_scatter_(aims_at_sky),
        sum_scatter_(aims_at_sky) {
    look();
  }

  /// What a set lacks it takes from the other, as the rows of the matrix do.
  std::array<Found, set_count> found_by_sets() const;
  OfParts flux_of_parts() const { return of_flux_.differences(); }
  OfParts lost_of_parts() const { return of_lost_.differences(); }
  double flux_of_rays() const { return flux_scatter_.variance(); }
  double sum_of_rays() const { return sum_scatter_.variance(); }
  /// What single rays scatter because the source is not equally bright everywhere.
  double variance_of_source() const { return squares_of_source_ / ray_count(); }

 private:
  void look();
  void add(std::size_t ray, double flux, double lost);
  double ray_count() const { return static_cast<double>(view_.matrix.row(row_).size()); }
  double in_sky() const { return sums_[0].sky + sums_[1].sky; }
  double direct() const {
    return static_cast<double>(direct_[0]) + static_cast<double>(direct_[1]);
  }
  double mean_of_others() const;

  const View& view_;
  const SetSums& sums_;
  std::span<const float> direct_;
  double direct_squares_;
  std::size_t row_;
  const Radiosity& radiosity_;
  std::array<Found, set_count> others_{};
  std::array<double, set_count> to_sky_beyond_{};  // that leaves more than the mean
  Parts of_flux_;
  Parts of_lost_;
  Scatter flux_scatter_;
  Scatter sum_scatter_;  // of flux and what is lost
  double squares_of_source_ = 0;
};

// What rays see that do not reach the sky.
double Row::mean_of_others() const {
  const double others = sums_[0].others + sums_[1].others;
  return others > 0 ? (ray_count() * radiosity_.flux()[row_] - direct()) / others : 0;
}

// A weight in place of 1 brings its part of what rays see that do not reach the sky, but what all
// weights lack is made up for by as much: only what a ray sees more than that scatters by weights.
void Row::look() {
  const ExchangeMatrix& matrix = view_.matrix;
  const auto rays = matrix.row(row_);
  const auto places = std::span(view_.places).subspan(matrix.first[row_], rays.size());
  const double usual = mean_of_others();
  const double of_sky = in_sky() > 0 ? direct() / in_sky() : 0;
  const double leaves = radiosity_.leaves(row_);
  double sky_squares = 0;
  for (std::size_t k = 0; k < rays.size(); ++k) {
    const auto weight = static_cast<double>(rays[k].weight);
    const std::uint32_t hit = rays[k].hit;
    if (hit < matrix.size()) {
      const double seen = radiosity_.leaves(hit) + dot(radiosity_.slopes()[hit], Vec3d(places[k]));
      others_[k % set_count].flux += weight * seen;
      add(k, weight * (seen - usual), 0);
    } else if (hit != matrix.size() + to_sky) {
      others_[k % set_count].out += weight;
      add(k, -weight * usual, weight * leaves);
    } else {
      const double beyond = dot(radiosity_.slopes()[row_], Vec3d(places[k]));
      to_sky_beyond_[k % set_count] += weight * beyond;
      sky_squares += square(weight * of_sky);
      add(k, weight * (of_sky - usual), weight * (leaves + beyond));
    }
  }
  squares_of_source_ = std::max(direct_squares_ - sky_squares, 0.0);
}

void Row::add(std::size_t ray, double flux, double lost) {
  of_flux_.add(ray, flux);
  of_lost_.add(ray, lost);
  flux_scatter_.add(ray, flux);
  sum_scatter_.add(ray, flux + lost);
}

std::array<Found, set_count> Row::found_by_sets() const {
  const double per_ray = static_cast<double>(set_count) / ray_count();
  std::array<Found, set_count> found{};
  for (std::size_t set = 0; set < set_count; ++set) {
    const std::size_t other = 1 - set;
    const double lacking = sums_[other].others > 0 ? sums_[set].lacking / sums_[other].others : 0;
    found[set] = {
        .flux = per_ray * (static_cast<double>(direct_[set]) + others_[set].flux +
                           lacking * others_[other].flux),
        .out = per_ray * (sums_[set].sky + others_[set].out + lacking * others_[other].out)};
    found[set].lost = radiosity_.leaves(row_) * found[set].out + per_ray * to_sky_beyond_[set];
  }
  return found;
}

Differences differences_of(std::size_t size) {
  return {std::vector<double>(size), std::vector<OfParts>(size), std::vector<float>(size)};
}

}  // namespace

// One ray of each part that is aimed at the sky makes four.
std::size_t part_count(const RayPlan& plan, const RayPlan::Block& block) {
  std::uint32_t least = plan.rays(block.begin);
  for (std::uint32_t rank = block.begin; rank < block.end; ++rank)
    least = std::min(least, plan.rays(rank));
  if (block.aims_at_sky) least /= RayPlan::rays_per_skyward;
  return least >= most_parts ? most_parts : most_parts / 2;
}

HalfDifferences half_differences(const View& view, std::size_t problem, const RayPlan& plan,
                                 const Radiosity& radiosity) {
  static_assert(set_count == 2);
  const std::size_t size = view.matrix.size();
  HalfDifferences halves{differences_of(size), std::vector<double>(size), differences_of(size),
                         std::vector<float>(size)};
  halves.flux.of_rays_in_parts.resize(size);
  parallel_for(size, 512, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      const RayPlan::Block& block = plan.block_of(i);
      const auto parts = static_cast<std::uint32_t>(part_count(plan, block));
      const Row row(view, problem, i, radiosity, {parts, plan.rays(i), block.aims_at_sky},
                    block.aims_at_sky);
      const auto found = row.found_by_sets();
      halves.flux.halves[i] = (found[0].flux - found[1].flux) / 2;
      halves.flux.parts[i] = row.flux_of_parts();
      halves.flux.of_rays_in_parts[i] = static_cast<float>(row.flux_of_rays());
      halves.sum_of_rays[i] = static_cast<float>(row.sum_of_rays());
      halves.flux.of_rays[i] = static_cast<float>(row.variance_of_source());
      halves.out[i] = (found[0].out - found[1].out) / 2;
      halves.lost.halves[i] = (found[0].lost - found[1].lost) / 2;
      halves.lost.parts[i] = row.lost_of_parts();
    }
  });
  return halves;
}

}  // namespace scarp
