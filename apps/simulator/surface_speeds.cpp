#include "apps/simulator/surface_speeds.h"

#include <fmt/format.h>

#include <cmath>
#include <variant>

#include "core/error.h"
#include "core/recipe/quantity.h"
#include "flux/reconstruct.h"
#include "levelset/grid/exposure.h"

namespace scarp {

namespace {

// What a model is asked about: facets, tallies on them, and what covers them.
struct SeenSurface {
  SmoothCorners facets;
  std::span<const std::span<const float>> flux;
  std::span<const std::vector<float>> coverages;
};

// Values at the three corners of every facet, in one row.
std::vector<float> at_corners(const SmoothCorners& facets, std::span<const float> on_facets) {
  std::vector<float> values;
  for (const auto& corners : corner_values(facets, on_facets))
    values.insert(values.end(), corners.begin(), corners.end());
  return values;
}

// The flux at the corners, one array per tally.
std::vector<std::vector<float>> flux_at_corners(const SmoothCorners& facets,
                                                std::span<const std::span<const float>> flux) {
  std::vector<std::vector<float>> tallies;
  for (const std::span<const float> tally : flux) tallies.push_back(at_corners(facets, tally));
  return tallies;
}

CornerSpeeds by_facet(const std::vector<float>& row) {
  CornerSpeeds speeds(row.size() / 3);
  for (std::size_t p = 0; p < row.size(); ++p) speeds[p / 3][p % 3] = row[p];
  return speeds;
}

// A model speaks of points: here the three corners of every facet, with the facet's own normal, so
// that speeds break where the surface does.
LayerSpeeds speeds_of_material(const std::vector<Vec3f>& corner_normals,
                               std::span<const std::vector<float>> corner_flux,
                               std::span<const std::vector<float>> corner_coverages,
                               const SurfaceModel& model, MaterialId material) {
  const std::vector<MaterialId> everywhere(corner_normals.size(), material);
  const SurfacePoints points{
      .material = everywhere, .normal = corner_normals, .coverages = corner_coverages};
  const std::vector<std::span<const float>> views(corner_flux.begin(), corner_flux.end());
  return {.speed = by_facet(model.speeds(points, views))};
}

// With factors of the normal it speaks of facets, where flux and normal belong together: a mean of
// the flux over facets that turn is that of none of their normals. Amplitudes do not turn.
LayerSpeeds parts_of_material(const SeenSurface& seen, const std::vector<Vec3f>& normals,
                              const SurfaceModel& model, std::span<const AngularFactor> factors,
                              MaterialId material) {
  const std::vector<MaterialId> everywhere(normals.size(), material);
  const SurfacePoints points{
      .material = everywhere, .normal = normals, .coverages = seen.coverages};
  LayerSpeeds speeds;
  for (const std::vector<float>& part : model.angular().amplitudes(points, seen.flux, factors))
    speeds.parts.push_back(corner_values(seen.facets, part));
  speeds.speed = speeds.parts.front();
  for (std::size_t k = 0; k < factors.size(); ++k) {
    for (std::size_t f = 0; f < normals.size(); ++f) {
      const float factor = factors[k].value(normals[f]);
      for (std::size_t corner = 0; corner < 3; ++corner)
        speeds.speed[f][corner] += factor * speeds.parts[1 + k][f][corner];
    }
  }
  return speeds;
}

std::vector<LayerSpeeds> speeds_at_corners(std::span<const Layer> stack, const SeenSurface& seen,
                                           const SurfaceModel& model,
                                           std::span<const AngularFactor> factors) {
  const std::vector<Vec3f> normals = facet_normals(seen.facets.mesh());
  std::vector<Vec3f> corner_normals;
  std::vector<std::vector<float>> corner_flux;
  std::vector<std::vector<float>> corner_coverages;
  if (factors.empty()) {
    for (const Vec3f& n : normals) corner_normals.insert(corner_normals.end(), 3, n);
    corner_flux = flux_at_corners(seen.facets, seen.flux);
    for (const std::vector<float>& coverage : seen.coverages)
      corner_coverages.push_back(at_corners(seen.facets, coverage));
  }
  std::vector<LayerSpeeds> speeds;
  for (std::size_t k = 0; k < stack.size(); ++k) {
    const MaterialId material = stack[k].material;
    std::size_t same = 0;
    while (stack[same].material != material) ++same;
    if (same < k) {
      speeds.push_back(speeds[same]);
    } else if (factors.empty()) {
      speeds.push_back(
          speeds_of_material(corner_normals, corner_flux, corner_coverages, model, material));
    } else {
      speeds.push_back(parts_of_material(seen, normals, model, factors, material));
    }
  }
  return speeds;
}

std::size_t layer_of(const State& state, MaterialId material) {
  std::size_t k = state.layers.stack.size() - 1;
  while (k > 0 && state.layers.stack[k].material != material) --k;
  return k;
}

[[noreturn]] void refuse_speed(const std::string& what, std::size_t facet, MaterialId material,
                               const TriMesh& facets, const SurfaceModel& model,
                               const Materials& materials) {
  const Vec3f r = facets.vertices[facets.triangles[facet][0]];
  const std::string formula = model.formula(material);
  throw NumericalError(fmt::format("{} on facet {} at ({:g}, {:g}, {:g}) nm, material {}{}", what,
                                   facet, r.x, r.y, r.z, materials[material].name,
                                   formula.empty() ? "" : fmt::format(", rate \"{}\"", formula)));
}

// Of all layers: one that is not seen may become exposed within the time step. And a step that
// deposits nothing must not let anything grow: what grew would be of which material?
void require_sound_speeds(const Survey& survey, const State& state, const ProcessStep& step,
                          const Materials& materials) {
  for (std::size_t f = 0; f < survey.facets.triangles.size(); ++f) {
    const std::size_t seen = layer_of(state, survey.facets.materials[f]);
    for (std::size_t k = 0; k < survey.speeds_of_layers.size(); ++k) {
      const MaterialId material = state.layers.stack[k].material;
      for (const float speed : survey.speeds_of_layers[k].speed[f]) {
        if (!std::isfinite(speed))
          refuse_speed("speed is not finite", f, material, survey.facets, *step.model, materials);
        if (k != seen || speed <= 0 || step.deposits) continue;
        refuse_speed(fmt::format("the surface grows, by {:g} nm/s, and the step names no material "
                                 "that is deposited,",
                                 speed),
                     f, material, survey.facets, *step.model, materials);
      }
    }
  }
}

Growth growth_of(const Survey& survey, const State& state, std::size_t material_count) {
  const Frame& frame = state.layers.frame;
  const std::vector<float> speeds = facet_speeds(state, survey);
  const std::vector<double> areas = areas_around(survey.facets, frame);
  Growth growth;
  growth.etched.resize(material_count);
  growth.area_of.resize(material_count);
  for (std::size_t f = 0; f < speeds.size(); ++f) {
    const double area = frame.facet_images() * areas[f];
    growth.area_of[survey.facets.materials[f]] += area;
    growth.net += area * speeds[f];
    growth.area += area;
    growth.gross += area * std::abs(speeds[f]);
    for (std::size_t k = 0; k < survey.speeds_of_layers.size(); ++k) {
      const float slowest = std::ranges::min(survey.speeds_of_layers[k].speed[f]);
      growth.etched[state.layers.stack[k].material] -= area * std::min(slowest, 0.0F);
    }
  }
  return growth;
}

std::string listed(std::span<const MaterialId> some, const Materials& materials) {
  std::string names;
  for (const MaterialId material : some)
    names += (names.empty() ? "" : ", ") + materials[material].name;
  return names;
}

// Why an operation changed nothing, and what to do.
class InVain {
 public:
  InVain(const Layers& layers, const Materials& materials)
      : layers_(layers), materials_(materials) {}

  std::string operator()(const Planarise& plane) const {
    if (plane.stop_material)
      return fmt::format("nothing lies above the {}; leave the step out",
                         materials_[*plane.stop_material].name);
    if (plane.height)
      return fmt::format("the surface lies below {} nm everywhere; lower height",
                         rounded_number(*plane.height));
    return too_thin("removal");
  }
  std::string operator()(const ConformalFilm& film) const {
    if (film.on.empty() || film.thickness < same_phi * layers_.frame.spacing)
      return too_thin("thickness");
    return fmt::format(
        "gas does not reach the materials on which it grows ({}); open them first, "
        "or change on",
        listed(film.on, materials_));
  }
  std::string operator()(const Fill& fill) const {
    const std::string plane = fill.height ? "height" : "above";
    if (fill.narrower_than)
      return fmt::format(
          "no opening below its plane is narrower than {} nm; raise {} or "
          "narrower_than",
          rounded_number(*fill.narrower_than), plane);
    if (!fill.on.empty())
      return fmt::format(
          "below its plane no gas lies straight above its materials ({}); raise {}, "
          "or change on",
          listed(fill.on, materials_), plane);
    return fmt::format("no gas that is joined to the source lies below its plane; raise {}", plane);
  }
  std::string operator()(const MaskFilm& mask) const {
    return fmt::format("its outline leaves no {} in the domain; change its opening or resist",
                       materials_[mask.shape.material].name);
  }
  std::string operator()(const Strip& strip) const {
    const std::string& name = materials_[strip.material].name;
    if (!has_material(layers_, strip.material))
      return fmt::format("there is no {} on the wafer; leave the step out", name);
    return fmt::format("gas does not reach the {}; open it first, or set buried = true", name);
  }

 private:
  static std::string too_thin(const std::string& key) {
    return fmt::format("less than a thousandth of a spacing changes; raise {}", key);
  }

  const Layers& layers_;
  const Materials& materials_;
};

}  // namespace

std::string standstill_text(const ProcessStep& step, const std::set<MaterialId>& seen,
                            const Materials& materials) {
  const std::vector<MaterialId> all(seen.begin(), seen.end());
  return fmt::format(
      "step \"{}\" moved nothing: the rates of {} are 0 on every exposed material ({})", step.name,
      step.model_name, listed(all, materials));
}

std::string standstill_text(const ProcessStep& step, const Layers& layers,
                            const Materials& materials) {
  return fmt::format("step \"{}\" moved nothing: {}", step.name,
                     std::visit(InVain(layers, materials), *step.operation));
}

std::vector<std::span<const float>> tallies_on_facets(std::span<const FluxField> flux) {
  std::vector<std::span<const float>> tallies;
  for (const FluxField& field : flux)
    for (const Tally& tally : field.tallies) tallies.emplace_back(tally.mean);
  return tallies;
}

void find_speeds(const State& state, const ProcessStep& step, const Materials& materials,
                 Survey& result) {
  if (!step.model) return;
  const auto measurement = result.timer.measure("map");
  result.factors = step.factors;
  result.speeds_of_layers = speeds_at_corners(
      state.layers.stack,
      {SmoothCorners(result.facets), tallies_on_facets(result.flux), result.coverages}, *step.model,
      result.factors);
  require_sound_speeds(result, state, step, materials);
  result.growth = growth_of(result, state, materials.size());
}

void find_change(const State& state, const ProcessStep& step, Survey& result) {
  const EarlierFlux& earlier = state.earlier;
  if (earlier.tallies.empty()) return;
  const auto measurement = result.timer.measure("map");
  const std::vector<std::span<const float>> flux(earlier.tallies.begin(), earlier.tallies.end());
  const std::vector<LayerSpeeds> before = speeds_at_corners(
      state.layers.stack, {SmoothCorners(state.mesh.facets), flux, state.coverages.values},
      *step.model, result.factors);
  std::vector<std::size_t> layers;
  for (const MaterialId material : result.facets.materials)
    layers.push_back(layer_of(state, material));
  result.change = speed_change({state.mesh.facets, before}, *tree_of(state.mesh),
                               {result.facets, result.speeds_of_layers}, layers, result.factors,
                               earlier.dt, state.layers.frame.spacing);
}

std::vector<float> facet_speeds(const State& state, const Survey& survey) {
  std::vector<float> speeds(survey.facets.triangles.size());
  if (survey.speeds_of_layers.empty()) return speeds;
  for (std::size_t f = 0; f < speeds.size(); ++f) {
    const std::size_t layer = layer_of(state, survey.facets.materials[f]);
    const auto& [a, b, c] = survey.speeds_of_layers[layer].speed[f];
    speeds[f] = (a + b + c) / 3;
  }
  return speeds;
}

}  // namespace scarp
