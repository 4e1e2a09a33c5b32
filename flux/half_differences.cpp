#include "flux/half_differences.h"

#include <algorithm>
#include <array>

#include "core/parallel.h"

namespace scarp {

namespace {

double square(double x) { return x * x; }

// What one set of an element's rays tells of all that it sees.
struct Told {
  double flux = 0;
  double out = 0;
  double lost = 0;
};

// Sums of powers over rays.
class Powers {
 public:
  void add(double x) {
    const double x2 = x * x;
    first_ += x;
    second_ += x2;
    third_ += x2 * x;
    fourth_ += x2 * x2;
  }
  void add_square(double more) { second_ += more; }
  /// Of the difference from the mean.
  double mean_square(double rays) const {
    return std::max(second_ / rays - square(first_ / rays), 0.0);
  }
  double mean_fourth(double rays) const {
    const double mean = first_ / rays;
    return std::max(
        (fourth_ - 4 * mean * third_ + 6 * mean * mean * second_) / rays - 3 * square(mean * mean),
        0.0);
  }

 private:
  double first_ = 0;
  double second_ = 0;
  double third_ = 0;
  double fourth_ = 0;
};

// The rays of an element.
class Row {
 public:
  Row(const View& view, std::size_t problem, std::size_t row, const Radiosity& radiosity)
      : view_(view),
        sums_(view.sums[row]),
        direct_(std::span(view.direct[problem]).subspan(row * set_count, set_count)),
        direct_squares_(view.direct_squares[problem][row]),
        row_(row),
        radiosity_(radiosity) {
    look();
  }

  /// What a set lacks it takes from the other, as the rows of the matrix do.
  std::array<Told, set_count> told_by_sets() const;
  double ray_count() const { return static_cast<double>(view_.matrix.row(row_).size()); }
  const Powers& of_flux() const { return of_flux_; }
  const Powers& of_lost() const { return of_lost_; }

 private:
  void look();
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
  std::array<Told, set_count> others_{};
  std::array<double, set_count> to_sky_beyond_{};  // that leaves more than the mean
  Powers of_flux_;
  Powers of_lost_;
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
      of_flux_.add(weight * (seen - usual));
    } else if (hit != matrix.size() + to_sky) {
      others_[k % set_count].out += weight;
      of_flux_.add(-weight * usual);
      of_lost_.add(weight * leaves);
    } else {
      const double beyond = dot(radiosity_.slopes()[row_], Vec3d(places[k]));
      to_sky_beyond_[k % set_count] += weight * beyond;
      sky_squares += square(weight * of_sky);
      of_flux_.add(weight * (of_sky - usual));
      of_lost_.add(weight * (leaves + beyond));
    }
  }
  // Of a source that is not equally bright everywhere.
  of_flux_.add_square(std::max(direct_squares_ - sky_squares, 0.0));
}

std::array<Told, set_count> Row::told_by_sets() const {
  const double per_ray = static_cast<double>(set_count) / ray_count();
  std::array<Told, set_count> told{};
  for (std::size_t set = 0; set < set_count; ++set) {
    const std::size_t other = 1 - set;
    const double lacking = sums_[other].others > 0 ? sums_[set].lacking / sums_[other].others : 0;
    told[set] = {
        .flux = per_ray * (static_cast<double>(direct_[set]) + others_[set].flux +
                           lacking * others_[other].flux),
        .out = per_ray * (sums_[set].sky + others_[set].out + lacking * others_[other].out)};
    told[set].lost = radiosity_.leaves(row_) * told[set].out + per_ray * to_sky_beyond_[set];
  }
  return told;
}

RayScatter scatter_of(std::size_t size) {
  return {std::vector<double>(size), std::vector<double>(size)};
}

}  // namespace

HalfDifferences half_differences(const View& view, std::size_t problem,
                                 const Radiosity& radiosity) {
  static_assert(set_count == 2);
  const std::size_t size = view.matrix.size();
  HalfDifferences halves{std::vector<double>(size), std::vector<double>(size),
                         std::vector<double>(size), scatter_of(size), scatter_of(size)};
  parallel_for(size, 512, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      const Row row(view, problem, i, radiosity);
      const auto told = row.told_by_sets();
      halves.flux[i] = (told[0].flux - told[1].flux) / 2;
      halves.out[i] = (told[0].out - told[1].out) / 2;
      halves.lost[i] = (told[0].lost - told[1].lost) / 2;
      halves.scatter_of_flux.squares[i] = row.of_flux().mean_square(row.ray_count());
      halves.scatter_of_flux.fourths[i] = row.of_flux().mean_fourth(row.ray_count());
      halves.scatter_of_lost.squares[i] = row.of_lost().mean_square(row.ray_count());
      halves.scatter_of_lost.fourths[i] = row.of_lost().mean_fourth(row.ray_count());
    }
  });
  return halves;
}

}  // namespace scarp
