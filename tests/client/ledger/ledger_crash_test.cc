// What was acknowledged stays, whenever the daemon is killed, and whenever those are killed who
// asked: ten vehicles with ledgers, one daemon, SIGKILL. ATLAS_TEST_SCALE=70 makes 2,100 kills of
// it. Who gets how far before a kill is the machine's to say: the seed fixes what is drawn, and no
// more.
#include <algorithm>
#include <filesystem>
#include <iostream>
#include <string>

#include <gtest/gtest.h>
#include <unistd.h>

#include "tests/client/ledger/crash_life.h"
#include "tests/core/support/test_scale.h"

namespace atlas::testing {
namespace {

constexpr std::uint32_t kKills = 30;
constexpr std::uint32_t kKillsOfALife = 150;
constexpr std::uint32_t kKillsBetweenChecks = 10;
constexpr std::uint32_t kSeed = 20'261;

std::ostream& operator<<(std::ostream& out, const Verdict& verdict) {
  return out << verdict.lost << " lost, " << verdict.twice << " twice, " << verdict.foreign
             << " never sent, " << verdict.altered << " altered, " << verdict.misplaced
             << " at another pose, " << verdict.torn << " batches in part, " << verdict.misjudged
             << " sessions in another state, " << verdict.left << " left of purged ones";
}

std::ostream& operator<<(std::ostream& out, const CrashFigures& figures) {
  std::vector<double> restarts = figures.restarts_ms;
  std::sort(restarts.begin(), restarts.end());
  out << "ledger: " << figures.kills << " kills, " << figures.kills_in_flight << " of them with "
      << figures.requests_cut << " requests in flight, " << figures.kills_in_start
      << " while it started, " << figures.starts_dirty << " starts with tiles to fuse; "
      << figures.vehicle_kills << " vehicles killed\nledger: " << figures.keyframes
      << " keyframes, " << figures.pose_batches << " pose batches and " << figures.session_changes
      << " changes of sessions acknowledged (" << figures.releases << " released, "
      << figures.purges << " purged), " << figures.unanswered
      << " never answered\nledger: " << figures.verdict << "; " << figures.digest_mismatches
      << " mismatches in " << figures.checks << " digests";
  if (!restarts.empty()) {
    out << "\nledger: exec to the first answer " << restarts[restarts.size() / 2] << " ms, at most "
        << restarts.back() << " ms";
  }
  return out;
}

class LedgerCrashTest : public ::testing::Test {
 protected:
  LedgerCrashTest()
      : folder_(std::filesystem::path(::testing::TempDir()) /
                ("atlas_ledger." + std::to_string(getpid()))) {
    std::filesystem::remove_all(folder_);
  }
  ~LedgerCrashTest() override {
    if (!HasFailure()) std::filesystem::remove_all(folder_);
  }

  std::filesystem::path folder_;
};

TEST_F(LedgerCrashTest, WhatWasAcknowledgedIsThereOnceWheneverTheDaemonIsKilled) {
  CrashFigures figures;
  std::uint32_t seed = kSeed;
  std::cout << "ledger: seed " << seed << std::endl;
  for (std::uint32_t left = Scaled(kKills); left > 0; seed += 1'000'000) {
    const std::uint32_t kills = std::min(left, kKillsOfALife);
    const std::filesystem::path folder = folder_ / std::to_string(seed);
    CrashLife(folder, seed, figures).Run(kills, kKillsBetweenChecks);
    ASSERT_EQ(figures.verdict.faults(), 0U) << figures.verdict.first << "; see " << folder;
    ASSERT_EQ(figures.digest_mismatches, 0U) << "see " << folder;
    std::filesystem::remove_all(folder);
    left -= kills;
  }
  std::cout << figures << std::endl;
  EXPECT_GT(figures.keyframes, 0U);
  // Else nothing was tested. Three kills, under sanitizers, may all come between requests.
  if (figures.kills >= kKills) {
    EXPECT_GT(figures.requests_cut, 0U);
    EXPECT_GT(figures.releases, 0U);
    EXPECT_GT(figures.purges, 0U);
  }
}

}  // namespace
}  // namespace atlas::testing
