#include "flux/flux_field.h"

namespace scarp {

double FluxAudit::balance_error() const {
  return emitted > 0 ? (absorbed + escaped + lost() - roulette - emitted) / emitted : 0;
}

}  // namespace scarp
