#include "flux/flux_field.h"

#include <gtest/gtest.h>

namespace scarp {
namespace {

TEST(FluxAudit, BalancesWhatLeftTheSource) {
  FluxAudit audit{.emitted = 100,
                  .absorbed = 60,
                  .escaped = 35,
                  .lost_back_face = 1,
                  .lost_below = 2,
                  .lost_side_limit = 3,
                  .roulette = 1};
  EXPECT_EQ(audit.lost(), 6);
  EXPECT_DOUBLE_EQ(audit.balance_error(), 0);
  audit.escaped = 30;
  EXPECT_DOUBLE_EQ(audit.balance_error(), -0.05);
  EXPECT_EQ(FluxAudit{}.balance_error(), 0);
}

}  // namespace
}  // namespace scarp
