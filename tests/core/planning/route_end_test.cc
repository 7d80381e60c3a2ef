// Where start and goal come to stand, and what is said of it.
#include <string_view>
#include <vector>

#include <gtest/gtest.h>

#include "core/planning/plan_route.h"
#include "tests/core/planning/tiny_world.h"

namespace atlas {
namespace {

TEST(RouteEndTest, EndsSayWhereTheyStandAndHowFarTheyWereMoved) {
  TinyWorld decks;
  decks.Draw(kCorridor, 0.0);
  decks.Draw({"                        ",  //
              ".S...................G..",  //
              "........................",  //
              "........................",  //
              "........................"},
             3.0);
  const auto route = PlanRoute(decks, decks.profile(),
                               {decks.start() + Eigen::Vector3d(0.0, 1.0, 1.8), decks.goal(), {}});
  ASSERT_TRUE(route.has_value());
  ASSERT_TRUE(route->start && route->goal);
  // North of the upper deck, whose rim a vehicle keeps off: moved there, not down.
  EXPECT_TRUE(route->start->asked.isApprox(decks.start() + Eigen::Vector3d(0.0, 1.0, 1.8)));
  EXPECT_NEAR(route->start->at.z(), 3.0, 1e-9);
  EXPECT_NEAR(route->start->above_m(), -1.8, 1e-6);
  EXPECT_GT(route->start->aside_m(), 0.5);
  EXPECT_LT(route->start->aside_m(), 3.0);
  EXPECT_EQ(route->start->layer, 1U);
  EXPECT_EQ(route->start->layers, 2U);
  EXPECT_TRUE(route->start->IsMoved(0.1));
  EXPECT_LT((route->waypoints.front() - route->start->at).norm(), 1e-6);
  EXPECT_LT((route->waypoints.back() - route->goal->at).norm(), 1e-6);
}

TEST(RouteEndTest, AnEndInItsOwnCellIsNotMoved) {
  TinyWorld world;
  world.Draw(kCorridor, 1.0);
  const auto first = world.Plan();
  ASSERT_TRUE(first && first->start && first->goal);
  const Eigen::Vector3d in_cell(0.04, -0.04, 0.04);
  const auto route =
      PlanRoute(world, world.profile(),
                {first->start->at + in_cell, first->goal->at + Eigen::Vector3d(0, 0, 0.06), {}});
  ASSERT_TRUE(route && route->start && route->goal);
  EXPECT_TRUE(route->start->at.isApprox(first->start->at));
  EXPECT_FALSE(route->start->IsMoved(0.1));
  EXPECT_TRUE(route->goal->IsMoved(0.1)) << "down by more than half a cell";
  EXPECT_EQ(route->goal->layers, 1U);
}

TEST(RouteEndTest, WhereTheVehicleMayNotStandThereIsNoEnd) {
  TinyWorld world;
  world.Draw({"....................",  //
              ".S.........#########",  //
              "...........####G####",  //
              "...........#########"},
             0.0);
  const auto route = world.Plan();
  ASSERT_TRUE(route.has_value());
  EXPECT_FALSE(route->found);
  EXPECT_TRUE(route->start.has_value());
  EXPECT_FALSE(route->goal.has_value());
}

}  // namespace
}  // namespace atlas
