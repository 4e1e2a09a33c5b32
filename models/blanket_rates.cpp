#include "models/blanket_rates.h"

#include <algorithm>
#include <optional>
#include <string>
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

/// By how much the wanted rates exceed those of the model.
class Scaling {
 public:
  Scaling(const RecipeTable& step, const StepScope& scope, const StepModel& made)
      : step_(step),
        scope_(scope),
        deposits_(made.deposits),
        named_(step.rows(blanket_rate.name)),
        speeds_(open_wafer_speeds(*made.model, scope.materials.size())) {}

  /// One per material; nothing where a rate cannot be had.
  std::optional<std::vector<float>> factors() const {
    const std::vector<float> wanted = read_per_material(
        step_, blanket_rate, {.materials = scope_.materials, .reachable = {}}, std::nullopt);
    if (!step_.ok(blanket_rate.name)) return std::nullopt;
    std::vector<float> factors(wanted.size(), 1.0F);
    for (std::size_t m = 0; m < wanted.size(); ++m) {
      const auto material = static_cast<MaterialId>(m);
      const bool is_named = names(material);
      // What the step itself deposits is no material of the wafer that one value could mean.
      if (wanted[m] == 0 || (!is_named && material == deposits_)) continue;
      if (speeds_[m] < 0) {
        factors[m] = -wanted[m] / speeds_[m];
      } else if (is_named && is_on_wafer(material)) {
        refuse(material);
      }
    }
    const bool asks_for_all = named_.empty() || std::ranges::count(named_, "default") > 0;
    const bool asks = std::ranges::any_of(wanted, [](float rate) { return rate > 0; });
    if (asks && asks_for_all && !etches_the_wafer())
      step_.error(blanket_rate.name,
                  "the step etches no material of the wafer where it is open, so there is nothing "
                  "to scale; leave it out");
    return step_.ok(blanket_rate.name) ? std::optional(factors) : std::nullopt;
  }

 private:
  bool names(MaterialId material) const {
    return std::ranges::find(named_, scope_.materials[material].name) != named_.end();
  }

  bool is_on_wafer(MaterialId material) const {
    return std::ranges::find(scope_.reachable, material) != scope_.reachable.end();
  }

  bool etches_the_wafer() const {
    return std::ranges::any_of(scope_.reachable, [&](MaterialId material) {
      return material != deposits_ && speeds_[material] < 0;
    });
  }

  void refuse(MaterialId material) const {
    const std::string& name = scope_.materials[material].name;
    const std::string why = speeds_[material] > 0 && deposits_
                                ? "on an open wafer of " + name + " the step deposits " +
                                      scope_.materials[*deposits_].name + " instead of etching"
                                : "the step does not etch an open wafer of " + name;
    step_.error(blanket_rate.name, why + ", so its rate has nothing to scale; leave it out");
  }

  const RecipeTable& step_;
  const StepScope& scope_;
  std::optional<MaterialId> deposits_;
  std::vector<std::string> named_;
  std::vector<float> speeds_;
};

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

StepModel with_blanket_rates(StepModel made, const RecipeTable& step, const StepScope& scope) {
  if (!step.has(blanket_rate.name)) return made;
  Scaling scaling(step, scope, made);
  if (const auto factors = scaling.factors())
    made.model = std::make_shared<ScaledRates>(std::move(made.model), *factors);
  return made;
}

}  // namespace scarp
