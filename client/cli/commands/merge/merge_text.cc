#include "client/cli/commands/merge/merge_text.h"

#include <numbers>
#include <string>
#include <vector>

#include "client/cli/output/text_table.h"
#include "client/merge/report/fused_tiles.h"
#include "client/merge/report/session_pairs.h"
#include "core/base/str_cat.h"

namespace atlas {
namespace {

constexpr double kDegree = 180.0 / std::numbers::pi;

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

void PrintSessions(const MergeRun& run, std::ostream& out) {
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
}

// Nothing of the kind, or what was found of each two sessions.
void PrintPairs(const MergeRun& run, std::ostream& out) {
  const std::vector<PairOutcome> pairs = PairsOf(run.plan);
  if (pairs.empty()) return;
  TextTable table({"session", "meets", ">closures", ">rejected", ">rms m", ">rms deg"});
  for (const PairOutcome& pair : pairs) {
    const bool is_any = pair.closures > 0;
    table.Row({StrCat(run.sessions[pair.a].key),
               pair.a == pair.b ? "itself" : StrCat(run.sessions[pair.b].key),
               std::to_string(pair.closures), std::to_string(pair.rejected),
               is_any ? FixedText(pair.off_m, 3) : "-",
               is_any ? FixedText(kDegree * pair.off_rad, 3) : "-"});
  }
  table.Print(out);
}

void PrintTotals(const MergePlan& plan, std::ostream& out) {
  if (plan.closures.empty()) {
    out << "no closures; ";
  } else {
    out << plan.closures.size() << " closures, off by "
        << FixedText(RootMeanSquare(plan.closure_off_m), 3) << " m and "
        << FixedText(kDegree * RootMeanSquare(plan.closure_off_rad), 3) << " deg; ";
  }
  out << plan.rejected_closures.size() << " rejected\n";
}

void PrintTiles(const MergeRun& run, std::ostream& out) {
  if (run.plan.tiles.empty()) {
    out << "no tiles to be fused again\n";
    return;
  }
  out << "tiles to be fused again:";
  const auto tiles = FusedTiles(run.plan.tiles, run.profile.levels);
  for (std::size_t level = 0; level < tiles.size(); ++level) {
    out << (level == 0 ? " " : ", ") << tiles[level].size() << " of level " << level;
  }
  out << '\n';
}

}  // namespace

void PrintMerge(const MergeRun& run, std::ostream& out) {
  PrintSessions(run, out);
  PrintPairs(run, out);
  PrintTotals(run.plan, out);
  PrintTiles(run, out);
}

}  // namespace atlas
