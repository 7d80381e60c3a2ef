// The judge of the crash test sees each fault that it is there to see, and no other.
#include "tests/client/ledger/ledger_judge.h"

#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "core/base/hash.h"

namespace atlas::testing {
namespace {

constexpr int kCar = 3;
const FrameId kFirst{0, 0};
const FrameId kSecond{0, 1};

class LedgerJudgeTest : public ::testing::Test {
 protected:
  void Store(const FrameId& frame, std::uint32_t version) {
    const KeyframeKey key = FleetKey(car_, frame);
    atlas_.frames[key] = {FleetTime(frame), FleetPose(car_, frame, version),
                          Hash64(FleetBlob(key))};
    atlas_.states.insert({key.session, SessionState::kLive});
  }
  void Write(const std::vector<std::string>& lines) {
    for (const std::string& line : lines) {
      ledger_.Apply(line);
    }
  }
  Verdict Judge(const LedgerJudge::Spooled& spooled = {}) const {
    LedgerJudge judge(atlas_);
    judge.Judge(car_, ledger_, spooled);
    return judge.Finish();
  }

  int car_ = kCar;
  StoredAtlas atlas_;
  LedgerState ledger_;
};

TEST_F(LedgerJudgeTest, WhatWasNotAnsweredMayBeThereOrNot) {
  Write({"upload 0 0", "uploaded 0 0", "upload 0 1", "move 1 0:0", "retract 0"});
  Store(kFirst, 0);
  EXPECT_EQ(Judge().faults(), 0U);
  Store(kFirst, 1);
  Store(kSecond, 0);
  atlas_.states[FleetSession(kCar, 0)] = SessionState::kRetracted;
  EXPECT_EQ(Judge().faults(), 0U);
}

TEST_F(LedgerJudgeTest, AnAcknowledgedOneThatIsNotThereIsLost) {
  Write({"upload 0 0", "uploaded 0 0"});
  EXPECT_EQ(Judge().lost, 1U);
}

TEST_F(LedgerJudgeTest, ATakenOneIsInTheSpoolOrThere) {
  Write({"put 0 0", "taken 0 0", "put 0 1"});
  EXPECT_EQ(Judge().lost, 1U);
  EXPECT_EQ(Judge({FleetKey(kCar, kFirst)}).faults(), 0U);
  Store(kFirst, 0);
  EXPECT_EQ(Judge().faults(), 0U);
  atlas_.frames.clear();
  Write({"sent"});
  EXPECT_EQ(Judge({FleetKey(kCar, kFirst)}).lost, 1U);
}

TEST_F(LedgerJudgeTest, OneThatNobodySentIsForeign) {
  Store(kFirst, 0);
  EXPECT_EQ(Judge().foreign, 1U);
}

TEST_F(LedgerJudgeTest, OtherBytesOrAnotherTimeAreAltered) {
  Write({"upload 0 0"});
  Store(kFirst, 0);
  ++atlas_.frames.begin()->second.time_ms;
  EXPECT_EQ(Judge().altered, 1U);
  Store(kFirst, 0);
  ++atlas_.frames.begin()->second.blob_hash;
  EXPECT_EQ(Judge().altered, 1U);
}

TEST_F(LedgerJudgeTest, AnEarlierPoseThanTheLastAcknowledgedOneIsAFault) {
  Write({"upload 0 0", "uploaded 0 0", "move 1 0:0", "moved 1", "move 2 0:0", "moved 2"});
  Store(kFirst, 1);
  EXPECT_EQ(Judge().misplaced, 1U);
  Store(kFirst, 7);
  EXPECT_EQ(Judge().misplaced, 1U);
  Store(kFirst, 2);
  EXPECT_EQ(Judge().faults(), 0U);
}

TEST_F(LedgerJudgeTest, ABatchHappensToAllOfItsKeyframes) {
  Write({"upload 0 0", "uploaded 0 0", "upload 0 1", "uploaded 0 1", "move 1 0:0 0:1"});
  Store(kFirst, 1);
  Store(kSecond, 0);
  EXPECT_EQ(Judge().torn, 1U);
  Store(kSecond, 1);
  EXPECT_EQ(Judge().faults(), 0U);
}

TEST_F(LedgerJudgeTest, ASessionIsAsItWasAcknowledged) {
  Write({"upload 0 0", "uploaded 0 0", "retract 0", "changed 0"});
  Store(kFirst, 0);
  EXPECT_EQ(Judge().misjudged, 1U);
  Write({"restore 0"});
  EXPECT_EQ(Judge().faults(), 0U);
}

TEST_F(LedgerJudgeTest, WhatWasPurgedIsGoneAndNoOther) {
  Write({"upload 0 0", "uploaded 0 0", "move 1 0:0", "moved 1", "purge 0"});
  Store(kFirst, 1);
  EXPECT_EQ(Judge().faults(), 0U) << "not answered";
  Write({"changed 0"});
  EXPECT_EQ(Judge().misjudged, 1U);
  atlas_.states[FleetSession(kCar, 0)] = SessionState::kPurged;
  EXPECT_EQ(Judge().left, 1U);
  atlas_.frames.clear();
  EXPECT_EQ(Judge().faults(), 0U);
  atlas_.states.clear();
  EXPECT_EQ(Judge().misjudged, 1U) << "its name is forgotten";
}

TEST_F(LedgerJudgeTest, NobodyPurgesWhatNobodyAskedToBePurged) {
  Write({"upload 0 0", "uploaded 0 0"});
  atlas_.states[FleetSession(kCar, 0)] = SessionState::kPurged;
  EXPECT_EQ(Judge().misjudged, 1U);
}

TEST_F(LedgerJudgeTest, ASessionThatLeapsIsInQuarantineUntilItIsReleased) {
  car_ = kLeapingVehicle;
  const FrameId wild{0, kLeapSequence};
  const SessionKey session = FleetSession(car_, 0);
  Write({"upload 0 0", "uploaded 0 0", "upload 0 6", "uploaded 0 6"});
  Store(kFirst, 0);
  Store(wild, 0);
  EXPECT_EQ(Judge().misjudged, 1U);
  atlas_.states[session] = SessionState::kQuarantined;
  EXPECT_EQ(Judge().faults(), 0U);
  atlas_.states[session] = SessionState::kReleased;
  EXPECT_EQ(Judge().misjudged, 1U);
  Write({"release 0"});
  EXPECT_EQ(Judge().faults(), 0U);
  Write({"changed 0"});
  EXPECT_EQ(Judge().faults(), 0U);
  atlas_.states[session] = SessionState::kQuarantined;
  EXPECT_EQ(Judge().misjudged, 1U);
}

TEST_F(LedgerJudgeTest, WhatWasThereIsThereStill) {
  Write({"upload 0 0"});
  Store(kFirst, 0);
  const StoredAtlas earlier = std::exchange(atlas_, {});
  LedgerJudge judge(atlas_);
  judge.Judge(kCar, ledger_, {});
  judge.JudgeAgainst(earlier);
  EXPECT_EQ(judge.Finish().lost, 1U);
}

}  // namespace
}  // namespace atlas::testing
