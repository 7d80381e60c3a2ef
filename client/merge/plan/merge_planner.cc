#include "client/merge/plan/merge_planner.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <set>
#include <utility>

#include "client/merge/plan/closure_search.h"
#include "client/merge/plan/held_sessions.h"
#include "client/merge/plan/merge_graph.h"
#include "client/merge/plan/pose_correction.h"
#include "client/merge/plan/prior_frame.h"
#include "client/merge/plan/rejected_closures.h"
#include "client/merge/plan/session_links.h"
#include "client/merge/plan/session_parts.h"
#include "client/merge/plan/tilt_check.h"

namespace atlas {
namespace {

class Planner {
 public:
  Planner(std::vector<MergeSession>& sessions,
          const std::vector<BlobReader>& readers,
          const MergeContext& context,
          const MergeProgress& progress,
          const MoreClosures& more_closures)
      : sessions_(sessions),
        readers_(readers),
        context_(context),
        options_(context.options),
        progress_(progress),
        more_closures_(more_closures) {}

  Result<MergePlan> Plan() {
    Status status = Run();
    if (status.ok()) status = LeaveOutTilted();
    if (status.ok()) status = Conclude();
    if (!status.ok()) return Error(std::move(status));
    return std::move(plan_);
  }

 private:
  Status Run() {
    for (std::size_t i = 0; i < sessions_.size(); ++i) {
      ATLAS_RETURN_IF_ERROR(Fuse(i, StoredPoses(sessions_[i]), options_.known_shape));
    }
    ATLAS_RETURN_IF_ERROR(Link(StoredPoses(sessions_)));
    ATLAS_RETURN_IF_ERROR(Search());
    for (int i = 0; i < options_.refinements; ++i) {
      ATLAS_RETURN_IF_ERROR(Refine());
    }
    return {};
  }

  Status Fuse(std::size_t session,
              const std::vector<Pose>& T_world_sensor,
              const ShapeTolerance& tolerance) {
    return BuildSubmaps(sessions_[session], T_world_sensor, readers_[session], context_, tolerance,
                        Step("submaps"));
  }

  Status Search() {
    ClosureSearch search(sessions_, ways_, context_);
    auto found = search.SearchAnywhere(Step("search"));
    if (!found) return found.error();
    ATLAS_RETURN_IF_ERROR(Settle(*found, nullptr));
    for (int round = 0; round < options_.guided_rounds; ++round) {
      auto near = search.SearchNear(poses_.T_world_submap, parts_.part_of, choice_.believed,
                                    Step("guided search"));
      if (!near) return near.error();
      if (near->empty()) break;
      // What was not believed before had its chance.
      near->insert(near->begin(), choice_.believed.begin(), choice_.believed.end());
      const SubmapPoses before = poses_.T_world_submap;
      ATLAS_RETURN_IF_ERROR(Settle(*near, &before));
      ++plan_.rounds;
    }
    return {};
  }

  // Everything once more with submaps as they are by now.
  Status Refine() {
    const std::set<std::size_t> joined = JoinedParts();
    for (std::size_t i = 0; i < sessions_.size(); ++i) {
      if (is_held_[i] || !joined.contains(parts_.part_of[i])) continue;
      ATLAS_RETURN_IF_ERROR(FuseAgain(i));
    }
    const SubmapPoses before = poses_.T_world_submap;
    ATLAS_RETURN_IF_ERROR(Link(before));
    ClosureSearch search(sessions_, ways_, context_);
    auto again = search.MatchAgain(choice_.believed, before, Step("closures again"));
    if (!again) return again.error();
    return Settle(*again, &before);
  }

  // One that would have to be tilted too far keeps the submaps it has; LeaveOutTilted looks at it.
  Status FuseAgain(std::size_t i) {
    const std::vector<Pose> corrected = CorrectedPoses(sessions_[i], poses_.T_world_submap[i]);
    Status status = Fuse(i, corrected, options_.refined_shape);
    return status.code() == StatusCode::kInvalidData ? Status() : status;
  }

  // One that would have to be tilted too far bends the others while it tilts: without it again, the
  // most tilted first, until there is none. With all that was found: what it contradicted may be
  // right. Whoever was left out has one more try at the end, when the others have their places.
  Status LeaveOutTilted() {
    for (bool is_tried_again = false;;) {
      const std::vector<FoundClosure> closures = rejected_.Without({});
      const auto before = left_out_;
      std::vector<std::size_t> tilted;
      for (auto worst = MostTilted();; worst = MostTilted()) {
        if (!worst) return worst.error();
        if (!*worst) break;
        left_out_.insert(**worst);
        tilted.push_back((*worst)->first);
        ATLAS_RETURN_IF_ERROR(SettleAgain(closures));
      }
      if (!tilted.empty()) {
        tilted.pop_back();  // it was the last one; those before it may have been bent by it
      } else if (!std::exchange(is_tried_again, true)) {
        for (const auto& [session, why] : left_out_) tilted.push_back(session);
      }
      for (const std::size_t session : tilted) ATLAS_RETURN_IF_ERROR(TakeBack(session, closures));
      if (is_tried_again && left_out_ == before) return {};
      if (options_.refinements > 0) ATLAS_RETURN_IF_ERROR(Refine());
    }
  }

  // If nobody is tilted with it.
  Status TakeBack(std::size_t session, const std::vector<FoundClosure>& closures) {
    auto why = left_out_.extract(session);
    ATLAS_RETURN_IF_ERROR(SettleAgain(closures));
    ATLAS_RETURN_IF_ERROR(SettleAgain(closures));  // where it meets few is known since it is back
    const auto worst = MostTilted();
    if (!worst) return worst.error();
    if (!*worst) return {};
    left_out_.insert(std::move(why));
    return SettleAgain(closures);
  }

  Status SettleAgain(const std::vector<FoundClosure>& closures) {
    const SubmapPoses before = poses_.T_world_submap;
    return Settle(closures, &before);
  }

  Result<std::optional<std::pair<std::size_t, std::string>>> MostTilted() {
    const std::set<std::size_t> joined = JoinedParts();
    std::optional<std::pair<std::size_t, std::string>> worst;
    double most_rad = 0.0;
    for (std::size_t i = 0; i < sessions_.size(); ++i) {
      if (is_held_[i] || IsLeftOut(i) || !joined.contains(parts_.part_of[i])) continue;
      const auto tilt = TiltOf(sessions_[i], CorrectedPoses(sessions_[i], poses_.T_world_submap[i]),
                               HeadersOf(i));
      if (!tilt) return Error(tilt.error());
      if (tilt->too_far.empty() || tilt->rms_rad <= most_rad) continue;
      worst = {i, tilt->Message()};
      most_rad = tilt->rms_rad;
    }
    return worst;
  }
  // Each blob is read once for its header.
  HeaderReader HeadersOf(std::size_t session) {
    return [this, session](std::size_t keyframe) -> Result<KeyframeHeader> {
      const auto known = headers_.find({session, keyframe});
      if (known != headers_.end()) return known->second;
      const auto blob = readers_[session](keyframe);
      if (!blob) return Error(blob.error());
      Result<KeyframeHeader> header = ReadKeyframeHeader(*blob);
      if (header) headers_.emplace(std::pair(session, keyframe), *header);
      return header;
    };
  }
  bool IsLeftOut(std::size_t session) const { return left_out_.contains(session); }

  ClosureSearch::Progress Step(std::string_view name) const {
    return [this, name](std::size_t done, std::size_t all) {
      return progress_ ? progress_(name, done, all) : Status();
    };
  }

  Status Link(const SubmapPoses& T_world_submap) {
    auto links = LinkSessions(sessions_, T_world_submap, context_, Step("odometry"));
    if (!links) return links.error();
    links_ = *std::move(links);
    ways_.clear();
    for (std::size_t i = 0; i < sessions_.size(); ++i) {
      ways_.push_back(WayOf(sessions_[i], links_[i]));
    }
    return {};
  }

  // Which closures are believed, who hangs together, and where everything is. Closures that all
  // others contradict once everything has its place were wrong, however well they agree with each
  // other: without them again.
  Status Settle(std::vector<FoundClosure> found, const SubmapPoses* start) {
    constexpr int kAttempts = 3;
    const std::vector<std::size_t> known_parts = parts_.part_of;
    const IsAsKnown is_as_known = [&](const FoundClosure& closure) {
      if (known_parts[closure.a.session] != known_parts[closure.b.session]) return false;
      const Pose expected = (*start)[closure.a.session][closure.a.submap].inverse() *
                            (*start)[closure.b.session][closure.b.submap];
      const double height_m = closure.match.T_a_b.translation().z() - expected.translation().z();
      return IsNearlyThere(closure.match.T_a_b, expected, options_) &&
             std::abs(height_m) <= options_.max_height_surprise_m;
    };
    if (more_closures_) {
      const std::vector<FoundClosure> more = more_closures_(found, ways_);
      found.insert(found.end(), more.begin(), more.end());
    }
    rejected_.Note(found);
    std::erase_if(found, [this](const FoundClosure& closure) {
      return IsLeftOut(closure.a.session) || IsLeftOut(closure.b.session);
    });
    for (int attempt = 1;; ++attempt) {
      choice_ = ChooseClosures(found, ways_, options_, start != nullptr ? is_as_known : nullptr);
      plan_.rejected += choice_.rejected.size();
      ATLAS_RETURN_IF_ERROR(Place(start));
      const std::size_t believed = choice_.believed.size();
      found = std::move(choice_.believed);
      std::erase_if(found, [this](const FoundClosure& closure) { return IsContradicted(closure); });
      const bool is_settled = found.size() == believed || attempt == kAttempts;
      plan_.rejected += believed - found.size();
      choice_.believed = found;
      if (is_settled) return {};
    }
  }

  // Where everything is by what is believed.
  Status Place(const SubmapPoses* start) {
    parts_ = PutTogether(sessions_, ways_, choice_);
    is_held_ = HeldSessions(sessions_, links_, choice_.believed, options_);
    SubmapPoses begin = start != nullptr ? *start : parts_.T_world_submap;
    for (std::size_t i = 0; i < sessions_.size(); ++i) {
      if (!is_held_[i]) continue;
      for (std::size_t k = 0; k < begin[i].size(); ++k) {
        begin[i][k] = StoredPose(sessions_[i], sessions_[i].submaps[k]);
      }
    }
    priors_ = PlaceByPriors(sessions_, parts_.part_of, is_held_, options_.priors, begin);
    std::vector<bool> uses_priors;
    for (const PriorUse& use : priors_) uses_priors.push_back(use.is_used);
    auto poses = OptimizeMerge({sessions_, links_, choice_.believed, is_held_, uses_priors}, begin,
                               options_);
    if (!poses) return poses.error();
    poses_ = *std::move(poses);
    return {};
  }

  // How far both its submaps are from where it has them to each other.
  Pose OffOf(const FoundClosure& closure) const {
    const Pose T_a_b = poses_.T_world_submap[closure.a.session][closure.a.submap].inverse() *
                       poses_.T_world_submap[closure.b.session][closure.b.submap];
    return closure.match.T_a_b.inverse() * T_a_b;
  }
  bool IsContradicted(const FoundClosure& closure) const {
    const Pose off = OffOf(closure);
    return off.translation().norm() > options_.contradicted_m ||
           Eigen::AngleAxisd(off.linear()).angle() > options_.contradicted_rad;
  }

  // The part that the map is, or becomes.
  std::set<std::size_t> JoinedParts() const {
    std::set<std::size_t> joined;
    std::map<std::size_t, std::size_t> keyframes;  // by part
    for (std::size_t i = 0; i < sessions_.size(); ++i) {
      if (IsLeftOut(i)) continue;
      if (!sessions_[i].is_staged) joined.insert(parts_.part_of[i]);
      keyframes[parts_.part_of[i]] += sessions_[i].keyframes.size();
    }
    if (!joined.empty() || keyframes.empty()) return joined;
    const auto largest =
        std::max_element(keyframes.begin(), keyframes.end(),
                         [](const auto& a, const auto& b) { return a.second < b.second; });
    return {largest->first};
  }

  Status Conclude() {
    const std::set<std::size_t> joined = JoinedParts();
    for (std::size_t i = 0; i < sessions_.size(); ++i) {
      SessionOutcome& outcome = plan_.sessions.emplace_back();
      outcome.is_joined = joined.contains(parts_.part_of[i]) && !IsLeftOut(i);
      outcome.is_refused = IsLeftOut(i);
      outcome.is_held = is_held_[i];
      outcome.submaps = sessions_[i].submaps.size();
      outcome.priors = priors_[i];
      outcome.prior_off_m = MedianOff(sessions_[i], poses_.T_world_submap[i]);
      if (outcome.is_joined && !outcome.is_held) Move(i, outcome);
      if (!outcome.is_joined) outcome.why_not = WhyNot(i, outcome);
      ATLAS_RETURN_IF_ERROR(LookAtEffect(i, outcome));
    }
    CountClosures();
    ListRejected();
    plan_.closures = choice_.believed;
    plan_.meetings = choice_.meetings;
    plan_.links = links_;
    return {};
  }

  // Positions are too coarse for it to be laid on the map by them.
  std::string WhyNot(std::size_t session, const SessionOutcome& outcome) const {
    if (const auto why = left_out_.find(session); why != left_out_.end()) return why->second;
    const bool has_map = std::any_of(sessions_.begin(), sessions_.end(),
                                     [](const MergeSession& one) { return !one.is_staged; });
    std::string why = has_map ? "meets no session of the map often enough"
                              : "there is no map yet, and more of what is staged belongs together "
                                "without it: published, that is the map";
    return outcome.priors.count == 0 ? why : why + ", and positions alone place no session";
  }

  void Move(std::size_t session, SessionOutcome& outcome) const {
    const MergeSession& own = sessions_[session];
    const std::vector<Pose> corrected = CorrectedPoses(own, poses_.T_world_submap[session]);
    double squares_m2 = 0.0;
    for (std::size_t i = 0; i < corrected.size(); ++i) {
      const Pose before = own.keyframes[i].T_world_sensor.ToPose();
      const Pose step = before.inverse() * corrected[i];
      const double move_m = step.translation().norm();
      squares_m2 += move_m * move_m;
      outcome.max_move_m = std::max(outcome.max_move_m, move_m);
      if (move_m < options_.min_move_m &&
          Eigen::AngleAxisd(step.linear()).angle() < options_.min_move_rad) {
        continue;
      }
      outcome.moved.push_back({i, QuantizedPose::FromPose(corrected[i])});
    }
    if (corrected.empty()) return;
    outcome.rms_move_m = std::sqrt(squares_m2 / static_cast<double>(corrected.size()));
  }

  Status LookAtEffect(std::size_t session, const SessionOutcome& outcome) {
    const bool is_published = outcome.is_joined && sessions_[session].is_staged;
    return AddTouchedTiles(sessions_[session], outcome.moved, is_published, HeadersOf(session),
                           context_.profile, plan_.tiles);
  }

  void CountClosures() {
    std::set<SubmapRef> met;
    for (const FoundClosure& closure : choice_.believed) {
      ++plan_.sessions[closure.a.session].closures;
      if (closure.a.session != closure.b.session) ++plan_.sessions[closure.b.session].closures;
      met.insert({closure.a, closure.b});
      const Pose off = OffOf(closure);
      plan_.closure_off_m.push_back(off.translation().norm());
      plan_.closure_off_rad.push_back(Eigen::AngleAxisd(off.linear()).angle());
    }
    for (const SubmapRef& ref : met) {
      ++plan_.sessions[ref.session].submaps_met;
    }
  }

  void ListRejected() {
    for (FoundClosure& closure : rejected_.Without(choice_.believed)) {
      const Pose off = OffOf(closure);
      const bool is_placed = parts_.part_of[closure.a.session] == parts_.part_of[closure.b.session];
      plan_.rejected_closures.push_back({std::move(closure), is_placed, off.translation().norm(),
                                         Eigen::AngleAxisd(off.linear()).angle()});
    }
  }

  std::vector<MergeSession>& sessions_;
  const std::vector<BlobReader>& readers_;
  const MergeContext& context_;
  const MergeOptions& options_;
  const MergeProgress& progress_;
  const MoreClosures& more_closures_;
  std::vector<std::vector<SessionLink>> links_;
  std::vector<SessionWay> ways_;
  ClosureChoice choice_;
  RejectedClosures rejected_;
  SessionParts parts_;
  std::vector<bool> is_held_;
  std::map<std::size_t, std::string> left_out_;                            // by session: why
  std::map<std::pair<std::size_t, std::size_t>, KeyframeHeader> headers_;  // session, keyframe
  std::vector<PriorUse> priors_;
  MergedPoses poses_;
  MergePlan plan_;
};

}  // namespace

Result<MergePlan> PlanMerge(std::vector<MergeSession>& sessions,
                            const std::vector<BlobReader>& readers,
                            const MergeContext& context,
                            const MergeProgress& progress,
                            const MoreClosures& more_closures) {
  if (Status status = context.options.Validate(); !status.ok()) return Error(std::move(status));
  return Planner(sessions, readers, context, progress, more_closures).Plan();
}

}  // namespace atlas
