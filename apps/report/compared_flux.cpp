#include "apps/report/compared_flux.h"

#include <algorithm>
#include <cmath>
#include <map>

#include "core/running_statistics.h"
#include "flux/reconstruct.h"
#include "mesh/files/mesh_file.h"

namespace scarp {

namespace {

namespace fs = std::filesystem;

/// A place on the profile. Units: nm.
struct ProfilePlace {
  double along = 0;
  Vec3d r;
};

/// Places half a spacing apart along the open lines of a profile: closed ones are voids.
std::vector<ProfilePlace> places_on(std::span<const Polyline> profile, double spacing) {
  std::vector<ProfilePlace> places;
  double length = 0;
  for (const Polyline& line : profile) {
    if (line.points.front() == line.points.back()) continue;
    for (std::size_t n = 1; n < line.points.size(); ++n) {
      const auto& [x0, z0] = line.points[n - 1];
      const auto& [x1, z1] = line.points[n];
      const double step = std::hypot(x1 - x0, z1 - z0);
      for (; static_cast<double>(places.size()) * 0.5 * spacing < length + step;) {
        const double along = static_cast<double>(places.size()) * 0.5 * spacing;
        const double part = step > 0 ? std::max(0.0, along - length) / step : 0;
        places.push_back({.along = along, .r = {x0 + part * (x1 - x0), 0, z0 + part * (z1 - z0)}});
      }
      length += step;
    }
  }
  return places;
}

constexpr std::size_t places_per_piece = 4;

bool is_flux(const std::string& name) {
  return name.starts_with("flux") && !name.starts_with("flux_std_error");
}

/// Each flux of an output along a profile, by its name: means over pieces.
std::map<std::string, std::vector<double>> flux_along(const fs::path& file,
                                                      std::span<const ProfilePlace> places) {
  const TriMesh mesh = read_mesh(file);
  const TriangleTree tree(mesh);
  std::vector<ClosestPoint> closest;
  for (const ProfilePlace& place : places) closest.push_back(tree.closest(place.r));
  std::map<std::string, std::vector<double>> found;
  for (const FacetArray& array : read_facet_arrays(file)) {
    if (!is_flux(array.name)) continue;
    const auto at_corners = corner_values(mesh, array.values);
    std::vector<double>& pieces = found[array.name];
    pieces.resize(places.size() / places_per_piece);
    for (std::size_t n = 0; n < pieces.size() * places_per_piece; ++n) {
      for (std::size_t corner = 0; corner < 3; ++corner)
        pieces[n / places_per_piece] += closest[n].barycentric[corner] *
                                        at_corners[closest[n].triangle][corner] / places_per_piece;
    }
  }
  return found;
}

using FluxRuns = std::vector<std::map<std::string, std::vector<double>>>;

ComparedFlux compared_flux(const std::string& name, std::span<const ProfilePlace> places,
                           const std::array<FluxRuns, 2>& groups) {
  ComparedFlux result{.name = name};
  RunningStatistics squares;
  RunningStatistics variances;
  for (std::size_t piece = 0; piece < places.size() / places_per_piece; ++piece) {
    std::array<Sample, 2> samples;
    for (std::size_t g = 0; g < 2; ++g) {
      std::vector<double> values;
      for (const auto& run : groups[g]) values.push_back(run.at(name)[piece]);
      samples[g] = sample_of(values);
    }
    const double difference = samples[1].mean - samples[0].mean;
    result.place.push_back(0.5 * (places[piece * places_per_piece].along +
                                  places[(piece + 1) * places_per_piece - 1].along));
    result.first.push_back(samples[0].mean);
    result.second.push_back(samples[1].mean);
    result.max_difference = std::max(result.max_difference, std::abs(difference));
    squares.add(difference * difference);
    if (const auto error = difference_error(samples[0], samples[1]))
      variances.add(error->std_error * error->std_error);
  }
  result.rms_difference = std::sqrt(squares.mean());
  if (variances.count() > 0) result.rms_std_error = std::sqrt(variances.mean());
  return result;
}

}  // namespace

std::vector<ComparedFlux> compare_fluxes(const std::array<std::vector<fs::path>, 2>& surfaces,
                                         const Snapshot& reference) {
  const std::vector<ProfilePlace> places = places_on(reference.profile, reference.frame.spacing);
  std::array<FluxRuns, 2> groups;
  for (std::size_t g = 0; g < 2; ++g) {
    for (const fs::path& file : surfaces[g]) {
      if (file.empty()) return {};
      groups[g].push_back(flux_along(file, places));
    }
  }
  std::vector<ComparedFlux> found;
  for (const auto& [name, values] : groups[0].front()) {
    const auto has = [&name = name](const auto& run) { return run.contains(name); };
    if (std::ranges::all_of(groups[0], has) && std::ranges::all_of(groups[1], has))
      found.push_back(compared_flux(name, places, groups));
  }
  return found;
}

}  // namespace scarp
