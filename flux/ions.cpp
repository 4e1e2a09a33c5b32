#include "flux/ions.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "core/error.h"
#include "core/recipe/quantity.h"
#include "flux/sampling/portable_math.h"
#include "flux/sampling/quantiles.h"
#include "flux/sampling/sampling.h"

namespace scarp {

namespace {

constexpr double right_angle = std::numbers::pi / 2;

// The part below x of a density x cos(pi / 2 x) in [0, 1].
double narrow_cone_part_below(double x) {
  return (x * std::sin(right_angle * x) + (std::cos(right_angle * x) - 1) / right_angle) /
         (1 - 1 / right_angle);
}

// An angle of a cone of opening 1 with that density.
double narrow_cone_angle(double u) {
  static const Quantiles table(
      1024, [](double part) { return inverse(narrow_cone_part_below, part, 0, 1); });
  return table.at(u);
}

// A polar angle in [0, cone) with density cos(pi / 2 phi / cone) sin(phi), from one that has phi
// for sin(phi): more than three of five draws are taken.
SineCosine sample_cone(double cone, RandomStream& random) {
  for (;;) {
    const double phi = cone * narrow_cone_angle(random.uniform());
    // By halves, which are in the range of the series.
    const auto [s, c] = portable_sine_cosine(phi / 2);
    const SineCosine whole{2 * s * c, 1 - 2 * s * s};
    if (random.uniform() * phi <= whole.sine) return whole;
  }
}

// Keeps flights off the plane they start from.
Vec3d off_the_plane(Vec3d u, Vec3d n) {
  constexpr double smallest_cosine = 1e-6;
  const double up = dot(u, n);
  return up < smallest_cosine ? normalized(u + (smallest_cosine - up) * n) : normalized(u);
}

}  // namespace

double YieldLaw::strength(double energy) const {
  return amplitude * std::max(0.0, std::sqrt(energy) - std::sqrt(threshold));
}

double YieldLaw::in_table(double energy, double half_sine) const {
  if (energy < table.front().energy) return 0;
  if (energy >= table.back().energy) return table.back().yield.at(half_sine);
  const auto above = std::upper_bound(table.begin(), table.end(), energy,
                                      [](double E, const AtEnergy& row) { return E < row.energy; });
  const AtEnergy& high = *above;
  const AtEnergy& low = *(above - 1);
  const double part = (energy - low.energy) / (high.energy - low.energy);
  return (1 - part) * low.yield.at(half_sine) + part * high.yield.at(half_sine);
}

double YieldLaw::largest(double energy) const {
  if (table.empty()) return strength(energy) * factor.largest();
  double bound = 0;
  for (const AtEnergy& row : table) {
    bound = std::max(bound, row.yield.largest());
    if (row.energy >= energy) break;
  }
  return bound;
}

double YieldLaw::least_energy() const {
  double least = table.empty() ? threshold : table.front().energy;
  for (const AtEnergy& row : table) {
    if (row.yield.largest() > 0) break;
    least = row.energy;
  }
  return least;
}

void YieldLaw::check(double largest_energy) const {
  const auto require = [](bool valid, const std::string& message) {
    if (!valid) throw InputError(message);
  };
  require(amplitude >= 0 && threshold >= 0 && factor.least() >= 0, "is negative somewhere");
  if (table.empty()) return;
  for (std::size_t k = 0; k < table.size(); ++k) {
    require(table[k].yield.least() >= 0, "is negative somewhere");
    require(k == 0 || table[k].energy > table[k - 1].energy, "has energies that do not ascend");
  }
  const AtEnergy& first = table.front();
  const auto text = [](double E) { return format_quantity(E, Dimension::energy); };
  require(first.energy == 0 || first.yield.largest() == 0,
          "begins at " + text(first.energy) +
              " with a yield; ions lose energy when they are reflected: begin at 0 eV, or with a "
              "yield of 0");
  require(table.back().energy >= largest_energy,
          "ends at " + text(table.back().energy) + ", but ions of up to " +
              rounded_number(largest_energy) +
              " eV come from the source; add what they do, or let their energies end below");
}

MeanYield::MeanYield(const YieldLaw& law, const EnergyDistribution& energy) {
  if (law.table.empty()) {
    strength_ = energy.mean([&](double E) { return law.strength(E); });
    factor_ = law.factor;
    return;
  }
  // A law that is linear between energies is a sum of tables, each with a weight that rises from
  // the energy below to its own and falls to the one above.
  std::vector<AngleTable> tables;
  std::vector<double> weights;
  const std::vector<YieldLaw::AtEnergy>& rows = law.table;
  for (std::size_t k = 0; k < rows.size(); ++k) {
    const auto weight = [&](double E) {
      if (E < rows[k].energy)
        return k == 0 ? 0.0
                      : std::max(0.0,
                                 (E - rows[k - 1].energy) / (rows[k].energy - rows[k - 1].energy));
      if (k + 1 == rows.size()) return 1.0;
      return std::max(0.0, (rows[k + 1].energy - E) / (rows[k + 1].energy - rows[k].energy));
    };
    tables.push_back(rows[k].yield);
    weights.push_back(energy.mean(weight));
  }
  factor_ = AngleTable::sum(tables, weights);
}

AngleTable sticking_between(double first, double second) {
  return AngleTable([=](double theta) {
    if (theta <= first) return 1.0;
    return std::max(0.0, (second - theta) / (second - first));
  });
}

AngleTable reflection_cone(double largest) {
  return AngleTable([=](double theta) { return right_angle - std::min(theta, largest); });
}

AngleTable kept_energy(double inflection, double power) {
  const double at_inflection = 1 / (1 + power * (right_angle / inflection - 1));
  return AngleTable([=](double theta) {
    if (theta < inflection) return at_inflection * std::pow(theta / inflection, power);
    return 1 - (1 - at_inflection) * (right_angle - theta) / (right_angle - inflection);
  });
}

Vec3d sample_reflection(Vec3d d, Vec3d n, double cone, RandomStream& random) {
  const Vec3d specular = d - 2 * dot(d, n) * n;
  Vec3d u = specular;
  if (cone > 0) {
    const auto [sine, cosine] = sample_cone(cone, random);
    const auto [y, x] = sample_azimuth(random.uniform());
    u = about_axis(sine * x, sine * y, cosine, specular);
  }
  // What would go into the solid leaves as in a mirror.
  const double up = dot(u, n);
  if (up < 0) u = u - 2 * up * n;
  return off_the_plane(u, n);
}

double sample_kept_energy(double mean, double deviation, RandomStream& random) {
  if (!(deviation > 0)) return mean;
  for (;;) {
    const double part = mean + deviation * standard_normal(random.uniform());
    if (part >= 0 && part <= 1) return part;
  }
}

}  // namespace scarp
