// A merge of an atlas file into which wrong closures are put beside those that are found: some
// alone, some three in a row that agree with each other, as a street has them that looks like
// another. Writes the corrections, and a JSON line.
// Usage: merge_bench ATLAS.db WORK_FOLDER SHARE SEED CORRECTIONS.txt   SHARE of all that are wrong
#include <cmath>
#include <cstdlib>
#include <iostream>
#include <random>
#include <string>
#include <vector>

#include "client/cli/files/pose_file.h"
#include "client/cli/files/whole_file.h"
#include "client/merge/merge_run.h"
#include "core/alignment/submap_match.h"

namespace atlas::testing {
namespace {

constexpr double kWrong_m = 5.0;
constexpr std::size_t kRow = 3;

// Where everything belongs, by a merge without them.
class Truth {
 public:
  explicit Truth(const MergeRun& run) : run_(run) {
    for (std::size_t i = 0; i < run.sessions.size(); ++i) {
      std::vector<Pose>& poses = poses_.emplace_back(StoredPoses(run.sessions[i]));
      for (const MovedKeyframe& moved : run.plan.sessions[i].moved) {
        poses[moved.keyframe] = moved.T_world_sensor.ToPose();
      }
    }
  }

  bool IsWrong(const FoundClosure& closure) const {
    const Pose T_a_b = Of(closure.a).inverse() * Of(closure.b);
    return (T_a_b.translation() - closure.match.T_a_b.translation()).norm() > kWrong_m;
  }

 private:
  Pose Of(const SubmapRef& ref) const {
    const MergeSession& session = run_.sessions[ref.session];
    const MergeSubmap& submap = session.submaps[ref.submap];
    return poses_[ref.session][submap.middle()] *
           (session.T_world_sensor[submap.middle()].inverse() * submap.T_world_submap);
  }

  const MergeRun& run_;
  std::vector<std::vector<Pose>> poses_;
};

class WrongClosures {
 public:
  WrongClosures(const Truth& truth, double share, std::uint64_t seed)
      : truth_(truth), share_(share), seed_(seed) {}

  std::vector<FoundClosure> operator()(const std::vector<FoundClosure>& found,
                                       const std::vector<SessionWay>& ways) {
    std::mt19937_64 random(seed_);
    const double wanted = static_cast<double>(found.size()) * share_ / (1.0 - share_);
    std::vector<FoundClosure> wrong;
    while (static_cast<double>(wrong.size()) < wanted) {
      const std::size_t row = random() % 2 == 0 ? 1 : kRow;
      for (const FoundClosure& one : Row(row, found, ways, random)) {
        if (truth_.IsWrong(one)) wrong.push_back(one);
      }
    }
    put_ += wrong.size();
    return wrong;
  }
  std::size_t put() const { return put_; }

 private:
  // Two vehicles in one lane, one way or the other, by what both drove from the first place on.
  static std::vector<FoundClosure> Row(std::size_t count,
                                       const std::vector<FoundClosure>& found,
                                       const std::vector<SessionWay>& ways,
                                       std::mt19937_64& random) {
    std::uniform_real_distribution<double> off(-3.0, 3.0);
    const std::size_t a = random() % ways.size();
    const std::size_t b = a + random() % (ways.size() - a);
    const std::size_t first_a = random() % ways[a].way_m.size();
    const std::size_t first_b = random() % ways[b].way_m.size();
    FoundClosure closure{{a, first_a}, {b, first_b}, found[random() % found.size()].match};
    closure.match.T_a_b.translation() = Eigen::Vector3d(off(random), off(random), 0.0);
    std::vector<FoundClosure> row;
    for (std::size_t i = 0; i < count; ++i) {
      if (first_a + i >= ways[a].way_m.size() || first_b + i >= ways[b].way_m.size()) break;
      FoundClosure next = closure;
      next.a.submap = first_a + i;
      next.b.submap = first_b + i;
      if (!(next.a < next.b)) break;
      const auto& of_a = ways[a].T_session_submap;
      const auto& of_b = ways[b].T_session_submap;
      next.match.T_a_b = (of_a[first_a].inverse() * of_a[first_a + i]).inverse() *
                         closure.match.T_a_b * (of_b[first_b].inverse() * of_b[first_b + i]);
      row.push_back(next);
    }
    return row;
  }

  const Truth& truth_;
  double share_;
  std::uint64_t seed_;
  std::size_t put_ = 0;
};

Status Run(const std::string& atlas,
           const std::string& folder,
           double share,
           std::uint64_t seed,
           const std::string& corrections) {
  auto file = AtlasFile::Open(atlas);
  if (!file) return file.error();
  FileSessions source(*std::move(file), atlas);
  auto work = MergeWork::Open(folder, kAlignmentRules, std::uint64_t{16} << 30U);
  if (!work) return work.error();
  const auto clean = RunMerge(source, {}, {}, *work, nullptr);
  if (!clean) return clean.error();
  const Truth truth(*clean);
  WrongClosures wrong(truth, share, seed);
  const auto run = RunMerge(source, {}, {}, *work, nullptr, std::ref(wrong));
  if (!run) return run.error();
  ATLAS_RETURN_IF_ERROR(WriteTextFile(corrections, PoseFileText(run->Corrections())));
  std::size_t believed = 0;
  for (const FoundClosure& closure : run->plan.closures) {
    believed += truth.IsWrong(closure) ? 1U : 0U;
  }
  std::cout << "{\"put\": " << wrong.put() << ", \"believed\": " << run->plan.closures.size()
            << ", \"wrong\": " << believed << "}\n";
  return {};
}

}  // namespace
}  // namespace atlas::testing

int main(int argc, char** argv) {
  if (argc != 6) {
    std::cerr << "usage: merge_bench ATLAS.db WORK_FOLDER SHARE SEED CORRECTIONS.txt\n";
    return 2;
  }
  const atlas::Status status = atlas::testing::Run(argv[1], argv[2], std::strtod(argv[3], nullptr),
                                                   std::strtoull(argv[4], nullptr, 10), argv[5]);
  if (!status.ok()) std::cerr << status.message() << '\n';
  return status.ok() ? 0 : 1;
}
