// Small graphs whose solution is known.
#include "client/merge/graph/pose_graph.h"

#include <cmath>
#include <limits>
#include <numbers>
#include <random>

#include <gtest/gtest.h>

namespace atlas {
namespace {

constexpr double kDegree = std::numbers::pi / 180.0;

Pose At(double x_m, double y_m = 0.0, double z_m = 0.0, double yaw_rad = 0.0) {
  Pose pose = Pose::Identity();
  pose.translation() = Eigen::Vector3d(x_m, y_m, z_m);
  pose.linear() = Eigen::AngleAxisd(yaw_rad, Eigen::Vector3d::UnitZ()).toRotationMatrix();
  return pose;
}

PoseInformation6 Sigmas(double place_m, double turn_rad) {
  Eigen::Matrix<double, 6, 1> sigmas;
  sigmas << place_m, place_m, place_m, turn_rad, turn_rad, turn_rad;
  return sigmas.cwiseAbs2().cwiseInverse().asDiagonal();
}

const PoseInformation6 kGood = Sigmas(0.01, 0.001);

PoseGraph Nodes(const std::vector<Pose>& poses, std::size_t fixed) {
  PoseGraph graph;
  for (std::size_t i = 0; i < poses.size(); ++i) graph.nodes.push_back({poses[i], i == fixed});
  return graph;
}
constexpr std::size_t kNone = 1'000;

void AddTrueEdge(PoseGraph& graph,
                 const std::vector<Pose>& truth,
                 std::size_t from,
                 std::size_t to) {
  graph.edges.push_back({from, to, truth[from].inverse() * truth[to], kGood, false});
}

// Twice around, and up.
std::vector<Pose> Spiral() {
  std::vector<Pose> poses;
  for (int i = 0; i < 40; ++i) {
    const double angle_rad = 4.0 * std::numbers::pi * i / 40.0;
    poses.push_back(At(30.0 * std::cos(angle_rad), 30.0 * std::sin(angle_rad), 0.1 * i, angle_rad));
  }
  return poses;
}

std::vector<Pose> Disturbed(std::vector<Pose> poses, double place_m, double yaw_rad) {
  std::mt19937 random(7);
  const auto draw = [&] {
    return static_cast<double>(random()) / 2147483648.0 - 1.0;
  };
  for (Pose& pose : poses) {
    pose.translation() += place_m * Eigen::Vector3d(draw(), draw(), draw());
    pose.rotate(Eigen::AngleAxisd(yaw_rad * draw(), Eigen::Vector3d::UnitZ()));
  }
  return poses;
}

double AngleBetween(const Pose& a, const Pose& b) {
  return Eigen::AngleAxisd(Eigen::Matrix3d(a.linear().transpose() * b.linear())).angle();
}

void ExpectNear(const std::vector<Pose>& is, const std::vector<Pose>& should, double within) {
  ASSERT_EQ(is.size(), should.size());
  for (std::size_t i = 0; i < is.size(); ++i) {
    EXPECT_LT((is[i].translation() - should[i].translation()).norm(), within) << i;
    EXPECT_LT(AngleBetween(is[i], should[i]), within) << i;
  }
}

TEST(PoseGraphTest, OfNothingIsNothing) {
  const auto result = Optimize({}, {});
  ASSERT_TRUE(result.has_value());
  EXPECT_TRUE(result->T_world_submap.empty());
  EXPECT_TRUE(result->edge_off_sigmas.empty());
}

TEST(PoseGraphTest, AChainOfExactEdgesIsPutRight) {
  const std::vector<Pose> truth = Spiral();
  std::vector<Pose> start = Disturbed(truth, 1.0, 20.0 * kDegree);
  start[0] = truth[0];
  PoseGraph graph = Nodes(start, 0);
  for (std::size_t i = 0; i + 1 < truth.size(); ++i) AddTrueEdge(graph, truth, i, i + 1);
  const auto result = Optimize(graph, {});
  ASSERT_TRUE(result.has_value());
  ExpectNear(result->T_world_submap, truth, 1e-4);
  EXPECT_GT(result->cost_before, 1e3);
  EXPECT_LT(result->cost_after, 1e-2);
  EXPECT_GT(result->iterations, 1);
  for (const double off : result->edge_off_sigmas) EXPECT_LT(off, 0.05);
}

// Springs in a row: each of ten gives a centimetre, and the closure as its own weight has it.
TEST(PoseGraphTest, ALoopSpreadsItsDrift) {
  for (const double closure_sigma_m : {0.001, 0.01, 0.1}) {
    std::vector<Pose> start;
    for (int i = 0; i <= 10; ++i) start.push_back(At(1.01 * i));
    PoseGraph graph = Nodes(start, 0);
    for (std::size_t i = 0; i < 10; ++i) graph.edges.push_back({i, i + 1, At(1.01), kGood, false});
    graph.edges.push_back({0, 10, At(10.0), Sigmas(closure_sigma_m, 0.001), false});
    const auto result = Optimize(graph, {});
    ASSERT_TRUE(result.has_value());
    const double chain = 1.0 / (10.0 * 0.01 * 0.01);
    const double closure = 1.0 / (closure_sigma_m * closure_sigma_m);
    const double end_m = (10.1 * chain + 10.0 * closure) / (chain + closure);
    for (std::size_t i = 0; i <= 10; ++i) {
      const Eigen::Vector3d at = result->T_world_submap[i].translation();
      EXPECT_NEAR(at.x(), 0.1 * end_m * static_cast<double>(i), 1e-6) << i;
      EXPECT_NEAR(at.tail<2>().norm(), 0.0, 1e-6) << i;
    }
    EXPECT_NEAR(result->edge_off_sigmas[10], (end_m - 10.0) / closure_sigma_m, 1e-3);
    EXPECT_NEAR(result->edge_off_sigmas[3], (10.1 - end_m) / 10.0 / 0.01, 1e-3);
  }
}

TEST(PoseGraphTest, AWrongClosureDoesNotPull) {
  const std::vector<Pose> truth = Spiral();
  PoseGraph graph = Nodes(truth, 0);
  for (std::size_t i = 0; i + 1 < truth.size(); ++i) AddTrueEdge(graph, truth, i, i + 1);
  for (const std::size_t i : {2U, 9U, 15U}) {
    AddTrueEdge(graph, truth, i, i + 20);
    graph.edges.back().may_be_wrong = true;
  }
  graph.edges.push_back({5, 25, At(8.0, 3.0), kGood, true});
  const auto robust = Optimize(graph, {});
  ASSERT_TRUE(robust.has_value());
  ExpectNear(robust->T_world_submap, truth, 0.02);
  EXPECT_GT(robust->edge_off_sigmas.back(), 100.0);
  graph.edges.back().may_be_wrong = false;
  const auto trusting = Optimize(graph, {});
  ASSERT_TRUE(trusting.has_value());
  EXPECT_GT((trusting->T_world_submap[25].translation() - truth[25].translation()).norm(), 0.5);
}

TEST(PoseGraphTest, FixedNodesStayExactly) {
  const std::vector<Pose> truth = Spiral();
  PoseGraph graph = Nodes(Disturbed(truth, 0.5, 0.1), 3);
  graph.nodes[17].is_fixed = true;
  for (std::size_t i = 0; i + 1 < truth.size(); ++i) AddTrueEdge(graph, truth, i, i + 1);
  graph.priors.push_back({3, Eigen::Vector3d::Zero(), Eigen::Vector3d(9.0, 9.0, 9.0),
                          Eigen::Vector3d::Constant(0.01)});
  const auto result = Optimize(graph, {});
  ASSERT_TRUE(result.has_value());
  for (const std::size_t i : {3U, 17U}) {
    const Pose& before = graph.nodes[i].T_world_submap;
    EXPECT_EQ(result->T_world_submap[i].translation(), before.translation());
    EXPECT_TRUE(result->T_world_submap[i].linear().isApprox(before.linear(), 1e-14));
  }
  EXPECT_GT(
      (result->T_world_submap[10].translation() - graph.nodes[10].T_world_submap.translation())
          .norm(),
      1e-3);
}

// Nodes 0, 2, 4 are one part, 1, 3, 5 another, and 6 is alone.
TEST(PoseGraphTest, APartWithNothingFixedStaysAtItsFirst) {
  std::vector<Pose> start;
  for (int i = 0; i < 7; ++i) start.push_back(At(100.0 * i, 7.0, -3.0, 0.3 * i));
  PoseGraph graph = Nodes(start, kNone);
  for (const std::size_t i : {0U, 1U, 2U, 3U}) {
    graph.edges.push_back({i + 2, i, At(-4.0, 0.0, 0.0, 0.5), kGood, false});
  }
  const auto result = Optimize(graph, {});
  ASSERT_TRUE(result.has_value());
  std::vector<Pose> should = start;
  for (const std::size_t i : {0U, 1U, 2U, 3U}) {
    should[i + 2] = should[i] * At(-4.0, 0.0, 0.0, 0.5).inverse();
  }
  ExpectNear(result->T_world_submap, should, 1e-4);
  for (const std::size_t i : {0U, 1U, 6U}) {
    EXPECT_EQ(result->T_world_submap[i].translation(), start[i].translation());
  }
}

TEST(PoseGraphTest, APartWithAFixedNodeIsNotHeldAtItsFirst) {
  PoseGraph graph = Nodes({At(0.0), At(5.0)}, 1);
  graph.edges.push_back({0, 1, At(4.0), kGood, false});
  const auto result = Optimize(graph, {});
  ASSERT_TRUE(result.has_value());
  ExpectNear(result->T_world_submap, {At(1.0), At(5.0)}, 1e-6);
}

// Known points of two submaps tell where the part lies and which way it is turned.
TEST(PoseGraphTest, PriorsPutAPartWhereItIs) {
  const Pose T_new_old = At(12.0, -7.0, 2.0, 25.0 * kDegree);
  PoseGraph graph = Nodes({At(0.0), At(10.0), At(20.0)}, kNone);
  graph.edges.push_back({0, 1, At(10.0), kGood, false});
  graph.edges.push_back({1, 2, At(10.0), kGood, false});
  for (const std::size_t node : {0U, 2U}) {
    const Eigen::Vector3d p_submap(1.0, 2.0, -0.5);
    graph.priors.push_back({node, p_submap, T_new_old * graph.nodes[node].T_world_submap * p_submap,
                            Eigen::Vector3d::Constant(0.02)});
  }
  const auto result = Optimize(graph, {});
  ASSERT_TRUE(result.has_value());
  std::vector<Pose> should;
  for (const GraphNode& node : graph.nodes) should.push_back(T_new_old * node.T_world_submap);
  ExpectNear(result->T_world_submap, should, 1e-3);
}

TEST(PoseGraphTest, APriorCountsAsItsAxesAreKnown) {
  PoseGraph graph = Nodes({At(0.0), At(1.0)}, 0);
  graph.edges.push_back({0, 1, At(1.0), Sigmas(0.1, 0.001), false});
  graph.priors.push_back({1, Eigen::Vector3d::Zero(), Eigen::Vector3d(1.2, 0.2, 0.2),
                          Eigen::Vector3d(0.001, 0.1, 100.0)});
  const auto result = Optimize(graph, {.robust_sigmas = 1e6});
  ASSERT_TRUE(result.has_value());
  EXPECT_NEAR(result->T_world_submap[1].translation().x(), 1.2, 1e-3);
  EXPECT_NEAR(result->T_world_submap[1].translation().y(), 0.1, 1e-3);
  EXPECT_NEAR(result->T_world_submap[1].translation().z(), 0.0, 1e-3);
}

// Four of one error know as much as one of them, and where they are too far off by their sigmas.
TEST(PoseGraphTest, PriorsOfOneErrorShareIt) {
  for (const double off_m : {0.2, 2.0}) {
    double alone_m = 0.0;
    for (const std::size_t count : {1U, 4U}) {
      PoseGraph graph = Nodes({At(0.0), At(1.0)}, 0);
      graph.edges.push_back({0, 1, At(1.0), Sigmas(0.1, 0.001), false});
      for (std::size_t i = 0; i < count; ++i) {
        graph.priors.push_back({1, Eigen::Vector3d::Zero(), Eigen::Vector3d(1.0, off_m, 0.0),
                                Eigen::Vector3d::Constant(0.1), 1.0 / static_cast<double>(count)});
      }
      const auto result = Optimize(graph, {});
      ASSERT_TRUE(result.has_value());
      const double moved_m = result->T_world_submap[1].translation().y();
      if (count == 1) alone_m = moved_m;
      EXPECT_NEAR(moved_m, alone_m, 1e-6);
    }
    EXPECT_EQ(alone_m > 0.05, off_m < 1.0) << alone_m;
  }
}

TEST(PoseGraphTest, APriorFarFromTheOthersDoesNotPull) {
  PoseGraph graph = Nodes({At(0.0), At(10.0), At(20.0), At(30.0)}, kNone);
  for (const std::size_t i : {0U, 1U, 2U}) {
    graph.edges.push_back({i, i + 1, At(10.0), Sigmas(0.01, 0.0001), false});
  }
  for (const std::size_t i : {0U, 1U, 2U, 3U}) {
    graph.priors.push_back(
        {i, Eigen::Vector3d::Zero(),
         Eigen::Vector3d(10.0 * static_cast<double>(i), i == 1 ? 30.0 : 0.0, 0.0),
         Eigen::Vector3d::Constant(0.5)});
  }
  const auto result = Optimize(graph, {});
  ASSERT_TRUE(result.has_value());
  EXPECT_LT(result->T_world_submap[1].translation().tail<2>().norm(), 0.2);
}

// Half as the edge says and half upright, where both know as much; a heading is no tilt.
TEST(PoseGraphTest, SubmapsStayUpright) {
  for (int i = 0; i < 4; ++i) {
    const double edge_sigma_rad = i < 2 ? 0.006 : 0.06;
    Pose tilted = At(2.0, 0.0, 0.0, 1.0);
    tilted.linear() =
        Eigen::AngleAxisd(2.0 * kDegree, Eigen::Vector3d::Unit(i % 2)) * tilted.linear();
    PoseGraph graph = Nodes({At(0.0), tilted}, 0);
    graph.edges.push_back({0, 1, tilted, Sigmas(0.01, edge_sigma_rad), false});
    const auto result = Optimize(graph, {.tilt_sigma_rad = 0.006});
    ASSERT_TRUE(result.has_value());
    const YawAndLevel attitude = SplitYaw(Eigen::Quaterniond(result->T_world_submap[1].linear()));
    EXPECT_NEAR(attitude.yaw_rad, 1.0, 1e-3);
    const double share = 0.006 * 0.006 / (0.006 * 0.006 + edge_sigma_rad * edge_sigma_rad);
    EXPECT_NEAR(Eigen::AngleAxisd(attitude.R_level_sensor).angle(), share * 2.0 * kDegree, 1e-4);
  }
}

// What is known along one axis only says nothing of the others, and axes are those of `from`.
TEST(PoseGraphTest, EachAxisIsAsWellKnownAsItIs) {
  PoseInformation6 along = Sigmas(1.0, 0.001);
  along.topLeftCorner<3, 3>() = Eigen::Vector3d(1e6, 0.0, 0.0).asDiagonal();
  PoseInformation6 across = Sigmas(1.0, 0.001);
  across.topLeftCorner<3, 3>() = Eigen::Vector3d(0.0, 1e6, 1e6).asDiagonal();
  const Pose from = At(50.0, 20.0, 1.0, 70.0 * kDegree);
  PoseGraph graph = Nodes({from, from * At(4.0, 4.0)}, 0);
  graph.edges.push_back({0, 1, At(3.0, 99.0, -99.0), along, false});
  graph.edges.push_back({0, 1, At(-99.0, 5.0, 0.5), across, false});
  const auto result = Optimize(graph, {});
  ASSERT_TRUE(result.has_value());
  ExpectNear(result->T_world_submap, {from, from * At(3.0, 5.0, 0.5)}, 1e-3);
}

// r' I r with r = (translation, rotation vector) in axes of `from`, about the origin of `to`.
TEST(PoseGraphTest, EdgesAreOffByTheirOwnMeasure) {
  std::mt19937 random(3);
  const auto draw = [&] {
    return static_cast<double>(random()) / 2147483648.0 - 1.0;
  };
  for (int round = 0; round < 20; ++round) {
    const Pose a = At(10.0 * draw(), 10.0 * draw(), draw(), 3.0 * draw());
    const Pose b = At(10.0 * draw(), 10.0 * draw(), draw(), 3.0 * draw());
    Eigen::Matrix<double, 6, 1> off;
    PoseInformation6 root;
    for (int i = 0; i < 6; ++i) {
      off(i) = (i < 3 ? 0.3 : 0.005) * draw();
      for (int k = 0; k < 6; ++k) root(i, k) = 10.0 * draw();
    }
    const PoseInformation6 information = root * root.transpose();
    Pose T_a_b = a.inverse() * b;
    T_a_b.translation() -= off.head<3>();
    const Eigen::Vector3d turn = off.tail<3>();
    T_a_b.linear() = Eigen::AngleAxisd(-turn.norm(), turn.normalized()) * T_a_b.linear();
    PoseGraph graph;
    graph.nodes = {{a, true}, {b, true}};
    graph.edges.push_back({0, 1, T_a_b, information, false});
    const auto result = Optimize(graph, {});
    ASSERT_TRUE(result.has_value());
    const double expected = std::sqrt(off.dot(information * off));
    EXPECT_NEAR(result->edge_off_sigmas[0], expected, 1e-3 + 1e-3 * expected) << round;
  }
}

TEST(PoseGraphTest, ThreadsDoNotMatterBeyondRounding) {
  const std::vector<Pose> truth = Spiral();
  PoseGraph graph = Nodes(Disturbed(truth, 0.5, 0.1), 0);
  std::mt19937 random(11);
  for (std::size_t i = 0; i + 1 < truth.size(); ++i) {
    AddTrueEdge(graph, truth, i, i + 1);
    graph.edges.back().T_from_to.translation().y() += 1e-3 * static_cast<double>(random() % 20);
  }
  for (std::size_t i = 0; i < 20; ++i) {
    AddTrueEdge(graph, truth, i, i + 20);
    graph.edges.back().may_be_wrong = true;
  }
  const auto one = Optimize(graph, {.threads = 1});
  const auto two = Optimize(graph, {.threads = 2});
  ASSERT_TRUE(one.has_value() && two.has_value());
  ExpectNear(two->T_world_submap, one->T_world_submap, 1e-6);
  EXPECT_NEAR(two->cost_after, one->cost_after, 1e-6 * one->cost_after);
}

}  // namespace
}  // namespace atlas
