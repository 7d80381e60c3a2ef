#include "client/cli/commands/merge/merge_json.h"

#include <numbers>
#include <string>
#include <vector>

#include <boost/json/array.hpp>

#include "client/cli/output/json_text.h"
#include "client/merge/report/fused_tiles.h"
#include "client/merge/report/session_pairs.h"

namespace atlas {
namespace {

constexpr double kDegree = 180.0 / std::numbers::pi;

boost::json::object PriorJson(const SessionOutcome& outcome) {
  boost::json::object json{{"count", outcome.priors.count}, {"used", outcome.priors.is_used}};
  if (outcome.priors.is_used) {
    json["median_off_m"] = Rounded(outcome.prior_off_m, 4);
  } else {
    json["why_not"] = outcome.priors.why_not;
  }
  return json;
}

boost::json::array SessionsJson(const MergeRun& run) {
  boost::json::array sessions;
  for (std::size_t i = 0; i < run.sessions.size(); ++i) {
    const SessionOutcome& outcome = run.plan.sessions[i];
    boost::json::object session{{"vehicle", run.sessions[i].key.vehicle},
                                {"session", run.sessions[i].key.session},
                                {"was_staged", run.sessions[i].is_staged},
                                {"joined", outcome.is_joined},
                                {"held", outcome.is_held},
                                {"keyframes", run.sessions[i].keyframes.size()},
                                {"moved", outcome.moved.size()},
                                {"rms_move_m", Rounded(outcome.rms_move_m, 4)},
                                {"max_move_m", Rounded(outcome.max_move_m, 4)},
                                {"submaps", outcome.submaps},
                                {"submaps_met", outcome.submaps_met},
                                {"closures", outcome.closures}};
    if (!outcome.is_joined) session["why_not"] = outcome.why_not;
    if (outcome.priors.count > 0) session["positions"] = PriorJson(outcome);
    sessions.push_back(std::move(session));
  }
  return sessions;
}

boost::json::object ClosureJson(const MergeRun& run, const FoundClosure& closure) {
  const auto end = [&](const SubmapRef& ref) {
    const MergeSession& session = run.sessions[ref.session];
    return boost::json::object{
        {"vehicle", session.key.vehicle},
        {"session", session.key.session},
        {"sequence", session.keyframes[At(run.sessions, ref).middle()].sequence}};
  };
  return {{"a", end(closure.a)}, {"b", end(closure.b)}, {"fit", Rounded(closure.match.fit, 3)}};
}

boost::json::array ClosuresJson(const MergeRun& run) {
  boost::json::array closures;
  for (std::size_t i = 0; i < run.plan.closures.size(); ++i) {
    boost::json::object closure = ClosureJson(run, run.plan.closures[i]);
    closure["off_m"] = Rounded(run.plan.closure_off_m[i], 4);
    closure["off_deg"] = Rounded(kDegree * run.plan.closure_off_rad[i], 4);
    closures.push_back(std::move(closure));
  }
  return closures;
}

// Of sessions that do not hang together it is not known by what they are off.
boost::json::array RejectedJson(const MergeRun& run) {
  boost::json::array rejected;
  for (const RejectedClosure& one : run.plan.rejected_closures) {
    boost::json::object closure = ClosureJson(run, one.closure);
    closure["off_m"] = one.is_placed ? boost::json::value(Rounded(one.off_m, 4)) : nullptr;
    closure["off_deg"] =
        one.is_placed ? boost::json::value(Rounded(kDegree * one.off_rad, 4)) : nullptr;
    rejected.push_back(std::move(closure));
  }
  return rejected;
}

boost::json::array PairsJson(const MergeRun& run) {
  boost::json::array pairs;
  const auto name = [&](std::size_t session) {
    const SessionKey& key = run.sessions[session].key;
    return boost::json::object{{"vehicle", key.vehicle}, {"session", key.session}};
  };
  for (const PairOutcome& pair : PairsOf(run.plan)) {
    boost::json::object json{{"a", name(pair.a)},         {"b", name(pair.b)},
                             {"closures", pair.closures}, {"rejected", pair.rejected},
                             {"rms_m", nullptr},          {"rms_deg", nullptr}};
    if (pair.closures > 0) {
      json["rms_m"] = Rounded(pair.off_m, 4);
      json["rms_deg"] = Rounded(kDegree * pair.off_rad, 4);
    }
    pairs.push_back(std::move(json));
  }
  return pairs;
}

boost::json::array TilesJson(const MergeRun& run) {
  boost::json::array tiles;
  for (const auto& level : FusedTiles(run.plan.tiles, run.profile.levels)) {
    for (const TileId& id : level) {
      tiles.push_back({{"level", id.level}, {"x", id.x}, {"y", id.y}});
    }
  }
  return tiles;
}

boost::json::array LeftOutJson(const MergeRun& run) {
  boost::json::array left_out;
  for (const LeftOut& one : run.left_out) {
    left_out.push_back(
        {{"vehicle", one.key.vehicle}, {"session", one.key.session}, {"why", one.why}});
  }
  return left_out;
}

}  // namespace

boost::json::object MergeJson(const MergeRun& run, const std::optional<PoseBatchSummary>& batch) {
  boost::json::object json{
      {"revision", run.revision},
      {"sessions", SessionsJson(run)},
      {"left_out", LeftOutJson(run)},
      {"closures", ClosuresJson(run)},
      {"rejected", run.plan.rejected},
      {"rejected_closures", RejectedJson(run)},
      {"pairs", PairsJson(run)},
      {"closure_rms_m", Rounded(RootMeanSquare(run.plan.closure_off_m), 4)},
      {"closure_rms_deg", Rounded(kDegree * RootMeanSquare(run.plan.closure_off_rad), 4)},
      {"keyframes_moved", run.Corrections().size()},
      {"published", run.Published().size()},
      {"tiles", run.plan.tiles.size()},
      {"tile_size_m", Rounded(run.profile.tile_size_m(), 6)},
      {"fused_tiles", TilesJson(run)},
      {"applied", batch.has_value()}};
  if (batch) {
    json["batch"] = batch->batch;
    json["updated"] = batch->updated;
    json["tiles_marked"] = batch->tiles_marked;
    json["revision_after"] = batch->revision;
  }
  return json;
}

}  // namespace atlas
