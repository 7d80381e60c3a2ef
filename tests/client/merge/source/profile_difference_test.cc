#include "client/merge/source/profile_difference.h"

#include <gtest/gtest.h>

namespace atlas {
namespace {

TEST(ProfileDifferenceTest, WhatDiffersIsNamedWithBothValues) {
  MapProfile one;
  EXPECT_EQ(DifferenceOf(one, MapProfile()), "");
  one.cell_size_um = 200'000;
  EXPECT_EQ(DifferenceOf(one, MapProfile()), "cells of 0.2 m instead of 0.1 m");
  one.preset = FusionPreset::kPaper;
  one.column_segments = 16;
  EXPECT_EQ(DifferenceOf(one, MapProfile()),
            "cells of 0.2 m instead of 0.1 m, columns of 16 segments instead of 8, preset paper "
            "instead of strict");
}

TEST(ProfileDifferenceTest, NumbersOfFusionAreToldTogether) {
  MapProfile one;
  one.same_layer_mm = 400;
  EXPECT_EQ(DifferenceOf(one, MapProfile()), "other rules of fusion, or another origin");
}

}  // namespace
}  // namespace atlas
