#include "models/surface_model.h"

#include <utility>

#include "models/inferred_response.h"

namespace scarp {

// The response asks the model for its species here, and for speeds not before it is whole.
SurfaceModel::SurfaceModel(std::vector<Species> species, const ModelParts& parts)
    : species_(std::move(species)), parts_(parts) {
  if (parts_.angular != nullptr) return;
  angular_ = std::make_unique<InferredResponse>(*this);
  parts_.angular = angular_.get();
}

SurfaceModel::~SurfaceModel() = default;

std::vector<std::string> coverage_names(const SurfaceModel* model) {
  if (model == nullptr || model->coverages() == nullptr) return {};
  return model->coverages()->coverage_names();
}

}  // namespace scarp
