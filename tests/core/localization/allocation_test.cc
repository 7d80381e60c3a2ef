// In steady state a localizer allocates nothing: a program of its own, since it counts every new.
#include <atomic>
#include <cstdlib>
#include <functional>
#include <new>

#include <gtest/gtest.h>

#include "core/localization/localizer.h"
#include "tests/core/localization/painted_map.h"

namespace {

std::atomic<std::size_t> allocations{0};

// All out of line: inlined, a compiler takes them for a mismatched pair.
[[gnu::noinline]] void* TryToAllocate(std::size_t size, std::size_t alignment) {
  ++allocations;
  const std::size_t whole = (size + alignment - 1) / alignment * alignment;
  return std::aligned_alloc(alignment, whole == 0 ? alignment : whole);
}
[[gnu::noinline]] void* Allocate(std::size_t size, std::size_t alignment) {
  void* memory = TryToAllocate(size, alignment);
  if (memory == nullptr) throw std::bad_alloc();
  return memory;
}
[[gnu::noinline]] void Release(void* memory) {
  std::free(memory);
}

}  // namespace

void* operator new(std::size_t size) {
  return Allocate(size, alignof(std::max_align_t));
}
void* operator new(std::size_t size, std::align_val_t alignment) {
  return Allocate(size, static_cast<std::size_t>(alignment));
}
// What std::stable_sort asks for.
void* operator new(std::size_t size, const std::nothrow_t&) noexcept {
  return TryToAllocate(size, alignof(std::max_align_t));
}
void operator delete(void* memory) noexcept {
  Release(memory);
}
void operator delete(void* memory, std::size_t) noexcept {
  Release(memory);
}
void operator delete(void* memory, std::align_val_t) noexcept {
  Release(memory);
}
void operator delete(void* memory, std::size_t, std::align_val_t) noexcept {
  Release(memory);
}

namespace atlas {
namespace {

using testing::UprightPose;

// `warm`: scans after which its buffers have grown.
void ExpectNoAllocations(const testing::PaintedMap& map,
                         const testing::ShapeWorld& world,
                         const std::function<Pose(double)>& at,
                         std::size_t warm,
                         bool is_deskewed = false) {
  std::vector<Pose> truths;
  std::vector<LeveledScan> scans;
  for (int i = 0; i < 24; ++i) {
    truths.push_back(at(-4.0 + 0.2 * i));
    scans.push_back(testing::CastLeveledScan(testing::QuickSensor(), world, truths.back()));
  }
  const std::size_t before_all = allocations;
  Localizer localizer(map.profile(), map.Source(), testing::QuickOptions());
  localizer.Start(truths.front());
  for (std::size_t i = 0; i < scans.size(); ++i) {
    const Eigen::Quaterniond upright = Eigen::Quaterniond::Identity();
    const std::size_t before = allocations;
    const auto result = is_deskewed ? localizer.LocalizeDeskewed(scans[i], upright, 1.0, 1.0)
                                    : localizer.Localize(scans[i], upright);
    const std::size_t during = allocations - before;
    ASSERT_TRUE(result);
    EXPECT_EQ(result->health, LocalizationHealth::kGood) << i;
    EXPECT_LT(testing::ErrorOf(result->T_world_sensor, truths[i]).horizontal_m, 0.06) << i;
    EXPECT_TRUE(i < warm || during == 0) << during << " at " << i;
  }
  EXPECT_GT(allocations - before_all, 100U) << "they are counted";
}

TEST(AllocationTest, ALocalizerThatHasItsMapAllocatesNothing) {
  ExpectNoAllocations(
      testing::StreetMap(), testing::Street(),
      [](double x_m) {
        return UprightPose({x_m, 0.1, 1.8 + 0.01 * x_m}, 0.0);
      },
      10);
}

TEST(AllocationTest, NorDoesOneThatLooksForTheMotionFirst) {
  ExpectNoAllocations(
      testing::StreetMap(), testing::Street(),
      [](double x_m) {
        return UprightPose({x_m, 0.1, 1.8 + 0.01 * x_m}, 0.0);
      },
      10, true);
}

TEST(AllocationTest, NorDoesOneThatComparesDecks) {
  ExpectNoAllocations(
      testing::GarageMap(), testing::GarageCorner(),
      [](double x_m) {
        return UprightPose({x_m, -4.0, 1.8}, 0.3);
      },
      10);
}

}  // namespace
}  // namespace atlas
