#include "client/merge/graph/pose_graph.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <ceres/ceres.h>

#include "core/base/str_cat.h"

namespace atlas {
namespace {

// A node as Ceres has it.
struct Block {
  Eigen::Vector3d p;
  Eigen::Quaterniond q;

  Pose ToPose() const {
    Pose pose = Pose::Identity();
    pose.translation() = p;
    pose.linear() = q.normalized().toRotationMatrix();
    return pose;
  }
};

template <typename T>
using Vector3 = Eigen::Matrix<T, 3, 1>;

// What is hardly known is known a little: factors there are, unless it is no information at all.
Eigen::LLT<PoseInformation6> FactorsOf(const PoseInformation6& information) {
  constexpr double kLittle = 1e-6;
  return (information + kLittle * PoseInformation6::Identity()).llt();
}

bool IsInformation(const PoseInformation6& matrix) {
  return matrix.allFinite() && FactorsOf(matrix).info() == Eigen::Success;
}

// How far b is from where the edge has it, seen from a, in sigmas.
class EdgeResidual {
 public:
  explicit EdgeResidual(const GraphEdge& edge)
      : p_(edge.T_from_to.translation()),
        q_(edge.T_from_to.linear()),
        root_(RootOf(edge.information)) {}

  template <typename T>
  bool operator()(const T* p_a, const T* q_a, const T* p_b, const T* q_b, T* residual) const {
    const Eigen::Map<const Vector3<T>> pa(p_a);
    const Eigen::Map<const Vector3<T>> pb(p_b);
    const Eigen::Map<const Eigen::Quaternion<T>> qa(q_a);
    const Eigen::Map<const Eigen::Quaternion<T>> qb(q_b);
    const Eigen::Quaternion<T> qa_inverse = qa.conjugate();
    Eigen::Matrix<T, 6, 1> off;
    off.template head<3>() = qa_inverse * (pb - pa) - p_.template cast<T>();
    // Of a small rotation twice the vector part is its rotation vector.
    const Eigen::Quaternion<T> turned = (qa_inverse * qb) * q_.template cast<T>().conjugate();
    const T sign = turned.w() < T(0) ? T(-2) : T(2);
    off.template tail<3>() = sign * turned.vec();
    Eigen::Map<Eigen::Matrix<T, 6, 1>> out(residual);
    out = root_.template cast<T>() * off;
    return true;
  }

 private:
  // L' of I = L L': |L' r|^2 = r' I r.
  static PoseInformation6 RootOf(const PoseInformation6& information) {
    return FactorsOf(information).matrixL().transpose();
  }

  Eigen::Vector3d p_;
  Eigen::Quaterniond q_;
  PoseInformation6 root_;
};

struct TiltResidual {
  double sigma_rad;

  template <typename T>
  bool operator()(const T* q_a, T* residual) const {
    const Eigen::Map<const Eigen::Quaternion<T>> q(q_a);
    const Vector3<T> up = q * Vector3<T>(T(0), T(0), T(1));
    residual[0] = up.x() / T(sigma_rad);
    residual[1] = up.y() / T(sigma_rad);
    return true;
  }
};

struct PriorResidual {
  GraphPrior prior;

  template <typename T>
  bool operator()(const T* p_a, const T* q_a, T* residual) const {
    const Eigen::Map<const Vector3<T>> p(p_a);
    const Eigen::Map<const Eigen::Quaternion<T>> q(q_a);
    const Vector3<T> off = p + q * prior.p_submap.cast<T>().eval() - prior.p_world.cast<T>().eval();
    for (int axis = 0; axis < 3; ++axis) {
      residual[axis] = off(axis) / T(prior.sigma_m(axis));
    }
    return true;
  }
};

Status Check(const PoseGraph& graph) {
  const std::size_t nodes = graph.nodes.size();
  for (const GraphEdge& edge : graph.edges) {
    if (edge.from >= nodes || edge.to >= nodes || edge.from == edge.to) {
      return {StatusCode::kInvalidArgument, StrCat("pose graph: an edge from ", edge.from, " to ",
                                                   edge.to, " of ", nodes, " nodes")};
    }
    if (!IsInformation(edge.information)) {
      return {StatusCode::kInvalidArgument,
              StrCat("pose graph: what is known of the edge from ", edge.from, " to ", edge.to,
                     " is not positive semidefinite")};
    }
  }
  for (const GraphPrior& prior : graph.priors) {
    const bool is_known = (prior.sigma_m.array() > 0.0).all() && prior.share > 0.0;
    if (prior.node >= nodes || !is_known) {
      return {StatusCode::kInvalidArgument,
              StrCat("pose graph: a prior of node ", prior.node, " of ", nodes, ", sigmas ",
                     prior.sigma_m.transpose(), " m, share ", prior.share, ", each to be above 0")};
    }
  }
  return {};
}

// Nodes that edges join, by the first one of each part.
class Parts {
 public:
  explicit Parts(const PoseGraph& graph) : first_(graph.nodes.size()) {
    std::iota(first_.begin(), first_.end(), 0U);
    for (const GraphEdge& edge : graph.edges) {
      const std::size_t a = Of(edge.from);
      const std::size_t b = Of(edge.to);
      first_[std::max(a, b)] = std::min(a, b);
    }
  }

  std::size_t Of(std::size_t node) {
    while (first_[node] != node) {
      first_[node] = first_[first_[node]];
      node = first_[node];
    }
    return node;
  }

 private:
  std::vector<std::size_t> first_;
};

// By node: it is fixed, or has to be.
std::vector<bool> FixedNodes(const PoseGraph& graph) {
  Parts parts(graph);
  std::vector<bool> is_held(graph.nodes.size(), false);
  for (std::size_t i = 0; i < graph.nodes.size(); ++i) {
    if (graph.nodes[i].is_fixed) is_held[parts.Of(i)] = true;
  }
  for (const GraphPrior& prior : graph.priors) {
    is_held[parts.Of(prior.node)] = true;
  }
  std::vector<bool> is_fixed(graph.nodes.size(), false);
  for (std::size_t i = 0; i < graph.nodes.size(); ++i) {
    is_fixed[i] = graph.nodes[i].is_fixed || (parts.Of(i) == i && !is_held[i]);
  }
  return is_fixed;
}

class Problem {
 public:
  Problem(const PoseGraph& graph, const PoseGraphOptions& options) : graph_(graph) {
    AddNodes(options);
    for (const GraphEdge& edge : graph.edges) {
      ceres::LossFunction* loss =
          edge.may_be_wrong ? new ceres::CauchyLoss(options.robust_sigmas) : nullptr;
      problem_.AddResidualBlock(NewEdgeCost(edge), loss, P(edge.from), Q(edge.from), P(edge.to),
                                Q(edge.to));
    }
    for (const GraphPrior& prior : graph.priors) {
      problem_.AddResidualBlock(
          new ceres::AutoDiffCostFunction<PriorResidual, 3, 3, 4>(new PriorResidual{prior}),
          NewPriorLoss(prior, options), P(prior.node), Q(prior.node));
    }
  }

  ceres::Solver::Summary Solve(const PoseGraphOptions& options) {
    ceres::Solver::Options how;
    how.linear_solver_type = ceres::SPARSE_NORMAL_CHOLESKY;
    how.max_num_iterations = options.max_iterations;
    how.num_threads = options.threads;
    how.function_tolerance = 1e-9;
    how.logging_type = ceres::SILENT;
    ceres::Solver::Summary summary;
    ceres::Solve(how, &problem_, &summary);
    return summary;
  }

  std::vector<Pose> Poses() const {
    std::vector<Pose> poses;
    poses.reserve(blocks_.size());
    for (const Block& block : blocks_) {
      poses.push_back(block.ToPose());
    }
    return poses;
  }

  std::vector<double> EdgesOff() {
    std::vector<double> off;
    off.reserve(graph_.edges.size());
    for (const GraphEdge& edge : graph_.edges) {
      Eigen::Matrix<double, 6, 1> residual;
      const EdgeResidual off_edge(edge);
      off_edge(P(edge.from), Q(edge.from), P(edge.to), Q(edge.to), residual.data());
      off.push_back(residual.norm());
    }
    return off;
  }

 private:
  static ceres::CostFunction* NewEdgeCost(const GraphEdge& edge) {
    return new ceres::AutoDiffCostFunction<EdgeResidual, 6, 3, 4, 3, 4>(new EdgeResidual(edge));
  }

  static ceres::LossFunction* NewPriorLoss(const GraphPrior& prior,
                                           const PoseGraphOptions& options) {
    return new ceres::ScaledLoss(new ceres::CauchyLoss(options.robust_sigmas), prior.share,
                                 ceres::TAKE_OWNERSHIP);
  }

  void AddNodes(const PoseGraphOptions& options) {
    blocks_.reserve(graph_.nodes.size());
    const std::vector<bool> is_fixed = FixedNodes(graph_);
    for (std::size_t i = 0; i < graph_.nodes.size(); ++i) {
      const Pose& pose = graph_.nodes[i].T_world_submap;
      blocks_.push_back({pose.translation(), Eigen::Quaterniond(pose.linear())});
      problem_.AddParameterBlock(P(i), 3);
      problem_.AddParameterBlock(Q(i), 4, new ceres::EigenQuaternionManifold);
      if (is_fixed[i]) {
        problem_.SetParameterBlockConstant(P(i));
        problem_.SetParameterBlockConstant(Q(i));
        continue;
      }
      problem_.AddResidualBlock(new ceres::AutoDiffCostFunction<TiltResidual, 2, 4>(
                                    new TiltResidual{options.tilt_sigma_rad}),
                                nullptr, Q(i));
    }
  }

  double* P(std::size_t node) { return blocks_[node].p.data(); }
  double* Q(std::size_t node) { return blocks_[node].q.coeffs().data(); }

  const PoseGraph& graph_;
  std::vector<Block> blocks_;
  ceres::Problem problem_;
};

}  // namespace

Result<PoseGraphResult> Optimize(const PoseGraph& graph, const PoseGraphOptions& options) {
  if (Status status = Check(graph); !status.ok()) return Error(std::move(status));
  Problem problem(graph, options);
  const ceres::Solver::Summary summary = problem.Solve(options);
  if (!summary.IsSolutionUsable()) {
    return Error(StatusCode::kInternal, StrCat("pose graph: ", summary.message));
  }
  PoseGraphResult result;
  result.T_world_submap = problem.Poses();
  result.edge_off_sigmas = problem.EdgesOff();
  result.iterations = static_cast<int>(summary.iterations.size());
  result.cost_before = summary.initial_cost;
  result.cost_after = summary.final_cost;
  return result;
}

}  // namespace atlas
