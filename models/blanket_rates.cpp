#include "models/blanket_rates.h"

#include <algorithm>
#include <utility>

#include "core/error.h"
#include "models/open_wafer.h"

namespace scarp {

namespace {

const Parameter blanket_rate{
    .name = "blanket_rate",
    .kind = Parameter::Kind::per_material,
    .dimension = Dimension::rate,
    .limits = {.fallback = "0 nm/s", .minimum = 0, .maximum = fastest_rate},
    .meaning = "etch rate of an open flat wafer, to which the rates are scaled; 0: as they are"};

}  // namespace

ScaledRates::ScaledRates(std::shared_ptr<const SurfaceModel> model, std::vector<float> factors)
    : SurfaceModel(model->species(), {.balance = model->balance(), .cycle = model->cycle()}),
      model_(std::move(model)),
      factors_(std::move(factors)) {
  SCARP_ASSERT(model_->emitter() == nullptr, ==, true);
  SCARP_ASSERT(model_->bath() == nullptr, ==, true);
}

std::vector<float> ScaledRates::speeds(const SurfacePoints& points,
                                       std::span<const std::span<const float>> flux) const {
  std::vector<float> speeds = model_->speeds(points, flux);
  for (std::size_t p = 0; p < speeds.size(); ++p)
    if (speeds[p] < 0) speeds[p] *= factors_[points.material[p]];
  return speeds;
}

std::shared_ptr<const SurfaceModel> with_blanket_rates(std::shared_ptr<const SurfaceModel> model,
                                                       const RecipeTable& step,
                                                       const StepScope& scope) {
  if (!step.has(blanket_rate.name)) return model;
  const std::vector<float> wanted = read_per_material(
      step, blanket_rate, {.materials = scope.materials, .reachable = {}}, std::nullopt);
  const std::vector<float> found = open_wafer_speeds(*model, scope.materials.size());
  std::vector<float> factors(wanted.size(), 1.0F);
  for (std::size_t m = 0; m < wanted.size(); ++m) {
    if (wanted[m] == 0) continue;
    if (found[m] < 0) {
      factors[m] = -wanted[m] / found[m];
    } else {
      const std::string& name = scope.materials[static_cast<MaterialId>(m)].name;
      step.error(blanket_rate.name, "the model does not etch an open wafer of " + name +
                                        ", so its rate has nothing to scale; leave it out");
    }
  }
  return std::make_shared<ScaledRates>(std::move(model), std::move(factors));
}

}  // namespace scarp
