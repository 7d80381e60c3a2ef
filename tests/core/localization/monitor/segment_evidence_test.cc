// Counts of hits and passes, and what follows from them.
#include "core/localization/monitor/segment_evidence.h"

#include <gtest/gtest.h>

namespace atlas {
namespace {

constexpr std::uint8_t kBoth = kLowerHalf | kUpperHalf;
constexpr SegmentSight kPassed{false, kBoth};
constexpr SegmentSight kHit{true, 0};

TEST(SegmentEvidenceTest, SixScansThroughAnOccupiedSegmentMakeItVanish) {
  OccupiedEvidence evidence;
  for (std::uint32_t scan = 10; scan < 16; ++scan) evidence.Add(kPassed, kBoth, scan);
  const auto verdict = evidence.Judge(kBoth, {});
  ASSERT_TRUE(verdict.has_value());
  EXPECT_EQ(verdict->kind, ContradictionKind::kVanished);
  EXPECT_EQ(verdict->passes, 6U);
  EXPECT_EQ(verdict->first_scan, 10U);
  EXPECT_EQ(verdict->last_scan, 15U);
  EXPECT_FALSE(OccupiedEvidence().Judge(kBoth, {}).has_value());
}

TEST(SegmentEvidenceTest, AHitOutweighsAFewPasses) {
  OccupiedEvidence evidence;
  for (std::uint32_t scan = 0; scan < 6; ++scan) evidence.Add(kPassed, kBoth, scan);
  evidence.Add(kHit, kBoth, 6);
  EXPECT_FALSE(evidence.Judge(kBoth, {}).has_value());
}

TEST(SegmentEvidenceTest, RaysAboveABollardSayNothingAboutIt) {
  OccupiedEvidence evidence;
  for (std::uint32_t scan = 0; scan < 50; ++scan) {
    evidence.Add({false, kUpperHalf}, kBoth, scan);
  }
  EXPECT_FALSE(evidence.Judge(kBoth, {}).has_value());
  // Where the lower half is ground, the upper one is all there is.
  EXPECT_TRUE(evidence.Judge(kUpperHalf, {}).has_value());
}

TEST(SegmentEvidenceTest, ASegmentThatFillsAppearsUnlessItIsOneStray) {
  FreeEvidence evidence;
  evidence.AddHit(kLowerHalf, 1);
  evidence.AddHit(kLowerHalf, 1);  // the same scan
  EXPECT_EQ(evidence.sum().hits, 1U);
  EXPECT_FALSE(evidence.Judge(evidence.sum(), {}, {}).has_value());
  for (std::uint32_t scan = 2; scan < 8; ++scan) evidence.AddHit(kLowerHalf, scan);
  const auto verdict = evidence.Judge(evidence.sum(), {}, {});
  ASSERT_TRUE(verdict.has_value());
  EXPECT_EQ(verdict->kind, ContradictionKind::kAppeared);
  EXPECT_EQ(verdict->hits, 7U);
}

TEST(SegmentEvidenceTest, BesideStructureItTakesMore) {
  FreeEvidence evidence;
  for (std::uint32_t scan = 0; scan < 6; ++scan) evidence.AddHit(kLowerHalf, scan);
  const PlaceContext beside{.is_driven = false, .is_beside_structure = true};
  EXPECT_TRUE(evidence.Judge(evidence.sum(), {}, {}).has_value());
  EXPECT_FALSE(evidence.Judge(evidence.sum(), beside, {}).has_value());
  for (std::uint32_t scan = 6; scan < 30; ++scan) evidence.AddHit(kLowerHalf, scan);
  EXPECT_TRUE(evidence.Judge(evidence.sum(), beside, {}).has_value());
}

TEST(SegmentEvidenceTest, WhatWasThereAndIsNotMoves) {
  FreeEvidence evidence;
  for (std::uint32_t scan = 0; scan < 3; ++scan) evidence.AddHit(kLowerHalf, scan);
  for (std::uint32_t scan = 3; scan < 9; ++scan) evidence.AddPass({false, kLowerHalf}, scan);
  const auto verdict = evidence.Judge(evidence.sum(), {}, {});
  ASSERT_TRUE(verdict.has_value());
  EXPECT_EQ(verdict->kind, ContradictionKind::kMoving);
}

TEST(SegmentEvidenceTest, WhatFlickersIsNothing) {
  FreeEvidence evidence;
  for (std::uint32_t scan = 0; scan < 30; ++scan) {
    if (scan % 5 == 0) {
      evidence.AddHit(kLowerHalf, scan);
    } else {
      evidence.AddPass({false, kLowerHalf}, scan);
    }
  }
  EXPECT_FALSE(evidence.Judge(evidence.sum(), {}, {}).has_value());
}

TEST(SegmentEvidenceTest, WhereTheVehicleWasThingsOnlyMove) {
  FreeEvidence evidence;
  for (std::uint32_t scan = 0; scan < 20; ++scan) evidence.AddHit(kLowerHalf, scan);
  const PlaceContext driven{.is_driven = true, .is_beside_structure = false};
  const auto verdict = evidence.Judge(evidence.sum(), driven, {});
  ASSERT_TRUE(verdict.has_value());
  EXPECT_EQ(verdict->kind, ContradictionKind::kMoving);
}

}  // namespace
}  // namespace atlas
