#include "client/cli/commands/merge/merge_text.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>
#include <vector>

#include <boost/json/array.hpp>

#include "client/cli/output/json_text.h"
#include "client/cli/output/text_table.h"
#include "core/base/str_cat.h"

namespace atlas {
namespace {

constexpr double kDegree = 180.0 / std::numbers::pi;

double Rms(const std::vector<double>& values) {
  double sum = 0.0;
  for (const double value : values) {
    sum += value * value;
  }
  return values.empty() ? 0.0 : std::sqrt(sum / static_cast<double>(values.size()));
}

// What becomes of a session, in one word.
std::string FateOf(const MergeSession& session, const SessionOutcome& outcome) {
  if (!outcome.is_joined) return session.is_staged ? "stays staged" : "stays";
  if (session.is_staged) return "published";
  return outcome.moved.empty() ? "stays" : "moved";
}

std::string PriorText(const SessionOutcome& outcome) {
  const PriorUse& priors = outcome.priors;
  const std::string count = StrCat(priors.count, " positions");
  if (!priors.is_used) return StrCat(count, " were not used: ", priors.why_not);
  return StrCat(count, ", off by ", FixedText(outcome.prior_off_m, 3), " m (median)",
                outcome.is_held ? "; it stays" : "");
}

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

boost::json::array ClosuresJson(const MergeRun& run) {
  boost::json::array closures;
  for (std::size_t i = 0; i < run.plan.closures.size(); ++i) {
    const FoundClosure& closure = run.plan.closures[i];
    const auto end = [&](const SubmapRef& ref) {
      const MergeSession& session = run.sessions[ref.session];
      return boost::json::object{
          {"vehicle", session.key.vehicle},
          {"session", session.key.session},
          {"sequence", session.keyframes[At(run.sessions, ref).middle()].sequence}};
    };
    closures.push_back({{"a", end(closure.a)},
                        {"b", end(closure.b)},
                        {"fit", Rounded(closure.match.fit, 3)},
                        {"off_m", Rounded(run.plan.closure_off_m[i], 4)},
                        {"off_deg", Rounded(kDegree * run.plan.closure_off_rad[i], 4)}});
  }
  return closures;
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

void PrintMerge(const MergeRun& run, std::ostream& out) {
  TextTable table(
      {"session", "", ">keyframes", ">moved", ">rms m", ">max m", ">submaps", ">met", ">closures"});
  for (std::size_t i = 0; i < run.sessions.size(); ++i) {
    const SessionOutcome& outcome = run.plan.sessions[i];
    table.Row({StrCat(run.sessions[i].key), FateOf(run.sessions[i], outcome),
               std::to_string(run.sessions[i].keyframes.size()),
               std::to_string(outcome.moved.size()), FixedText(outcome.rms_move_m, 3),
               FixedText(outcome.max_move_m, 3), std::to_string(outcome.submaps),
               std::to_string(outcome.submaps_met), std::to_string(outcome.closures)});
  }
  table.Print(out);
  for (std::size_t i = 0; i < run.sessions.size(); ++i) {
    if (run.plan.sessions[i].is_joined) continue;
    out << run.sessions[i].key << ": " << run.plan.sessions[i].why_not << '\n';
  }
  for (std::size_t i = 0; i < run.sessions.size(); ++i) {
    if (run.plan.sessions[i].priors.count == 0) continue;
    out << run.sessions[i].key << ": " << PriorText(run.plan.sessions[i]) << '\n';
  }
  for (const LeftOut& left_out : run.left_out) {
    out << left_out.key << ": left out, " << left_out.why << '\n';
  }
  out << run.plan.closures.size() << " closures, off by "
      << FixedText(Rms(run.plan.closure_off_m), 3) << " m and "
      << FixedText(kDegree * Rms(run.plan.closure_off_rad), 3) << " deg; " << run.plan.rejected
      << " rejected; " << run.plan.tiles.size() << " tiles to be fused again\n";
}

boost::json::object MergeJson(const MergeRun& run, const std::optional<PoseBatchSummary>& batch) {
  boost::json::object json{{"revision", run.revision},
                           {"sessions", SessionsJson(run)},
                           {"left_out", LeftOutJson(run)},
                           {"closures", ClosuresJson(run)},
                           {"rejected", run.plan.rejected},
                           {"closure_rms_m", Rounded(Rms(run.plan.closure_off_m), 4)},
                           {"closure_rms_deg", Rounded(kDegree * Rms(run.plan.closure_off_rad), 4)},
                           {"keyframes_moved", run.Corrections().size()},
                           {"published", run.Published().size()},
                           {"tiles", run.plan.tiles.size()},
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
