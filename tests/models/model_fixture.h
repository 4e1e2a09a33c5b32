#pragma once

#include <algorithm>
#include <memory>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "core/recipe/recipe_table.h"
#include "models/registry.h"

namespace scarp {

/// The model of a step that is all right, on a wafer of Si and SiO2, or of other materials, 100 nm
/// wide.
inline StepModel read_step(const std::string& model, const std::string& keys,
                           bool two_dimensional = false,
                           const std::vector<std::string>& wafer = {"Si", "SiO2"}) {
  const RecipeFile file({"[[step]]\n" + keys, "r.toml"});
  const Materials materials;
  const Frame frame{
      .spacing = 10, .cells = {10, two_dimensional ? 1 : 10}, .two_dimensional = two_dimensional};
  std::vector<MaterialId> reachable;
  for (const std::string& name : wafer) {
    const MaterialId id = materials.id(name);
    if (std::ranges::find(reachable, id) == reachable.end()) reachable.push_back(id);
  }
  StepModel step =
      find_model(model)->read(file.root().tables("step")[0], {materials, reachable, frame});
  file.finish();
  return step;
}

/// Points of some materials, all facing up unless said otherwise.
struct Points {
  std::vector<MaterialId> material;
  std::vector<Vec3f> normal;

  explicit Points(const std::vector<std::string>& names, std::vector<Vec3f> normals = {})
      : normal(std::move(normals)) {
    for (const std::string& name : names) material.push_back(Materials().id(name));
    normal.resize(material.size(), {0, 0, 1});
  }
  operator SurfacePoints() const { return {material, normal}; }
};

/// A model at one point of a material, where all tallies are known.
class ModelAtPoint {
 public:
  ModelAtPoint(const std::string& model, const std::string& keys, const std::string& material,
               Vec3f normal = {0, 0, 1})
      : model_(read_step(model, keys, false, {"Si", "SiO2", material}).model),
        species_(model_->species()),
        point_({material}, {normal}) {}

  const SurfaceModel& model() const { return *model_; }
  const std::vector<Species>& species() const { return species_; }

  double speed() const { return model_->speeds(point_, flux()).front(); }
  double emission() const { return model_->emitter()->emission(point_, flux()).front().front(); }
  std::vector<float> amplitudes() const {
    std::vector<float> parts;
    const AngularResponse& angular = model_->angular();
    for (const auto& part : angular.amplitudes(point_, flux(), angular.factors()))
      parts.push_back(part.front());
    return parts;
  }
  /// 0 where the model knows none.
  double coverage(std::size_t k) const {
    if (model_->balance() == nullptr) return 0;
    const auto coverages = model_->balance()->steady_coverages(point_, flux());
    return k < coverages.size() ? coverages[k].front() : 0;
  }
  std::vector<std::vector<float>> sticking() const {
    const BalancedCoverages& balance = *model_->balance();
    return balance.covered_sticking(point_, balance.steady_coverages(point_, flux()));
  }

 protected:
  /// Tallies of an ion that comes along the normal with its mean energy.
  void add_ions(const Species& ion, double arrivals) {
    tallies_.push_back(static_cast<float>(arrivals));
    for (const YieldLaw& law : ion.yields)
      tallies_.push_back(static_cast<float>(arrivals * law.at(ion.ions->energy.mean(), 0)));
  }

  std::vector<float> tallies_;

 private:
  std::vector<std::span<const float>> flux() const {
    std::vector<std::span<const float>> flux;
    for (const float& tally : tallies_) flux.emplace_back(&tally, 1);
    return flux;
  }

  std::shared_ptr<const SurfaceModel> model_;
  std::vector<Species> species_;
  Points point_;
};

}  // namespace scarp
