#include "client/cli/commands/merge/serve_events.h"

#include <sstream>

#include <gtest/gtest.h>

namespace atlas {
namespace {

const SessionKey kKey{"car", "monday"};

// Of one staged session that stays where it is.
MergeRun StaysStaged(bool is_refused) {
  MergeRun run;
  run.sessions.resize(1);
  run.sessions[0].key = kKey;
  run.sessions[0].is_staged = true;
  run.plan.sessions.resize(1);
  run.plan.sessions[0].is_refused = is_refused;
  run.plan.sessions[0].why_not = is_refused ? "tilted" : "meets nobody";
  return run;
}

class ServeEventsTest : public ::testing::Test {
 protected:
  void Note(MergeEventKind kind, const MergeRun& run) {
    events_.Note({.kind = kind, .sessions = {kKey}, .run = &run});
  }

  std::ostringstream out_;
  ServeLog log_{out_, "atlas-merge", true};
  ServeEvents events_{log_, "here", std::nullopt};
};

TEST_F(ServeEventsTest, WhoMeetsNobodyWaits) {
  Note(MergeEventKind::kNothing, StaysStaged(false));
  EXPECT_TRUE(events_.refused().ok()) << events_.refused().message();
}

TEST_F(ServeEventsTest, WhatNoOtherSessionHelpsIsRefused) {
  Note(MergeEventKind::kNothing, StaysStaged(true));
  EXPECT_EQ(events_.refused(), Status(StatusCode::kInvalidData, "car/monday stays staged: tilted"));
}

TEST_F(ServeEventsTest, SoIsADamagedSession) {
  MergeRun run;
  run.left_out = {{kKey, "damaged: its record"}, {{"car", "friday"}, "not asked for"}};
  Note(MergeEventKind::kNothing, run);
  EXPECT_EQ(events_.refused().code(), StatusCode::kInvalidData);
  EXPECT_NE(events_.refused().message().find("car/monday"), std::string::npos);
}

}  // namespace
}  // namespace atlas
