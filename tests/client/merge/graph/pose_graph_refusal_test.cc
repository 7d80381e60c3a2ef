// Graphs that are none.
#include <limits>

#include <Eigen/Geometry>
#include <gtest/gtest.h>

#include "client/merge/graph/pose_graph.h"

namespace atlas {
namespace {

class PoseGraphRefusalTest : public ::testing::Test {
 protected:
  void ExpectRefused(StatusCode code = StatusCode::kInvalidArgument) const {
    const auto result = Optimize(graph_, {});
    ASSERT_FALSE(result.has_value());
    EXPECT_EQ(result.error().code(), code) << result.error().message();
  }

  PoseGraphRefusalTest() { graph_.nodes = {{Pose::Identity(), true}, {Ahead(), false}}; }
  static Pose Ahead() { return Pose(Eigen::Translation3d(1.0, 0.0, 0.0)); }

  const PoseInformation6 kGood = 1e4 * PoseInformation6::Identity();
  PoseGraph graph_;
};

TEST_F(PoseGraphRefusalTest, EdgesOfNodesThatAreNotThere) {
  graph_.edges = {{0, 2, Ahead(), kGood, false}};
  ExpectRefused();
  graph_.edges = {{2, 0, Ahead(), kGood, false}};
  ExpectRefused();
}

TEST_F(PoseGraphRefusalTest, AnEdgeFromANodeToItself) {
  graph_.edges = {{1, 1, Ahead(), kGood, false}};
  ExpectRefused();
}

TEST_F(PoseGraphRefusalTest, APriorOfANodeThatIsNotThere) {
  graph_.priors = {{2, Eigen::Vector3d::Zero(), Eigen::Vector3d::Zero(), Eigen::Vector3d::Ones()}};
  ExpectRefused();
}

TEST_F(PoseGraphRefusalTest, APriorThatKnowsItsPlaceExactlyOrNotAtAll) {
  for (const double sigma_m : {0.0, -1.0, std::numeric_limits<double>::quiet_NaN()}) {
    for (int axis = 0; axis < 3; ++axis) {
      GraphPrior prior{1};
      prior.sigma_m(axis) = sigma_m;
      graph_.priors = {prior};
      ExpectRefused();
    }
  }
}

TEST_F(PoseGraphRefusalTest, APriorThatIsNoPartOfOne) {
  for (const double share : {0.0, -1.0, std::numeric_limits<double>::quiet_NaN()}) {
    GraphPrior prior{1};
    prior.share = share;
    graph_.priors = {prior};
    ExpectRefused();
  }
}

TEST_F(PoseGraphRefusalTest, InformationThatIsNone) {
  for (const double value :
       {-1.0, std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity()}) {
    for (const int i : {0, 2, 5}) {
      PoseInformation6 information = kGood;
      information(i, i) = value;
      graph_.edges = {{0, 1, Ahead(), information, false}};
      ExpectRefused();
    }
  }
}

TEST_F(PoseGraphRefusalTest, NoSolutionIsAnErrorOfItsOwn) {
  Pose nowhere = Ahead();
  nowhere.translation().x() = std::numeric_limits<double>::quiet_NaN();
  graph_.edges = {{0, 1, nowhere, kGood, false}};
  ExpectRefused(StatusCode::kInternal);
}

}  // namespace
}  // namespace atlas
