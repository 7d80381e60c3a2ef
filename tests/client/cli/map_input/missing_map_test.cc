// What is told of an atlas without a map, and what to do.
#include "client/cli/map_input/missing_map.h"

#include <string>
#include <vector>

#include <gtest/gtest.h>

namespace atlas {
namespace {

SessionSummary Session(const std::string& name, const std::string& state, std::uint64_t keyframes) {
  SessionSummary session;
  session.key = {"vehicle", name};
  session.state = state;
  session.keyframes = keyframes;
  return session;
}

bool Says(const Status& status, const std::string& words) {
  return status.message().find(words) != std::string::npos;
}

TEST(MissingMapTest, AnEmptyAtlasWantsADrive) {
  const Status status = MissingMapStatus({});
  EXPECT_EQ(status.code(), StatusCode::kNotFound);
  EXPECT_TRUE(Says(status, "the atlas is empty")) << status.message();
  EXPECT_TRUE(Says(status, "atlas ingest DRIVE")) << status.message();
}

TEST(MissingMapTest, WhatIsNotFusedYetWantsTimeOrADaemon) {
  const std::vector<SessionSummary> sessions = {Session("a", "live", 5), Session("b", "staged", 5)};
  const Status daemon = MissingMapStatus({7, sessions, false});
  EXPECT_EQ(daemon.code(), StatusCode::kNotFound);
  EXPECT_TRUE(Says(daemon, "7 tiles wait to be fused (atlas wait")) << daemon.message();
  const Status file = MissingMapStatus({7, sessions, true});
  EXPECT_TRUE(Says(file, "7 tiles wait to be fused (atlasd")) << file.message();
}

TEST(MissingMapTest, SessionsOutsideTheMapAreCountedWithTheirWayIn) {
  const std::vector<SessionSummary> sessions = {
      Session("a", "staged", 5),    Session("b", "staged", 1), Session("c", "quarantined", 5),
      Session("d", "retracted", 5), Session("e", "staged", 0), Session("f", "purged", 0)};
  const Status status = MissingMapStatus({0, sessions, false});
  EXPECT_EQ(status.code(), StatusCode::kNotFound);
  EXPECT_TRUE(Says(status, "2 staged (atlas session publish")) << status.message();
  EXPECT_TRUE(Says(status, "1 quarantined (atlas session release")) << status.message();
  EXPECT_TRUE(Says(status, "1 retracted (atlas session restore")) << status.message();
  EXPECT_FALSE(Says(status, "empty")) << status.message();
}

}  // namespace
}  // namespace atlas
