#pragma once

#include <memory>
#include <vector>

#include "models/parameter.h"
#include "models/surface_model.h"

namespace scarp {

/// A model whose etching of each material is a number of times as fast: so its open flat wafer has
/// a rate that was measured. What grows, coverages and what sticks stay as they are.
class ScaledRates : public SurfaceModel {
 public:
  /// Shape: one factor per material. The model may have no angular response of its own, nor a bath
  /// or an emitter, whose books would not balance.
  ScaledRates(std::shared_ptr<const SurfaceModel> model, std::vector<float> factors);

  std::vector<float> speeds(const SurfacePoints& points,
                            std::span<const std::span<const float>> flux) const override;
  std::string formula(MaterialId material) const override { return model_->formula(material); }

 private:
  std::shared_ptr<const SurfaceModel> model_;
  std::vector<float> factors_;
};

/// Reads `blanket_rate` from a step, if it is there: rates of open flat wafers that its model is to
/// have, by material. One value, or default, is for the materials that the model etches; a row for
/// a material that is not on the wafer is not used. Units: nm/s.
StepModel with_blanket_rates(StepModel made, const RecipeTable& step, const StepScope& scope);

}  // namespace scarp
