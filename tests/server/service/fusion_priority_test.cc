// Workers stand back behind the threads that answer.
#include <algorithm>
#include <atomic>

#include <gtest/gtest.h>
#include <sys/resource.h>

#include "tests/server/service/service_fixture.h"

namespace atlas {
namespace {

using FusionPriorityTest = ServiceTest;

TEST_F(FusionPriorityTest, WorkersAreNicerThanTheOthers) {
  Open(0);
  const int ours = ::getpriority(PRIO_PROCESS, 0);
  std::atomic<int> nicest{ours};
  const WallClock clock = [&nicest] {  // workers ask it what time it is
    nicest = std::max(nicest.load(), ::getpriority(PRIO_PROCESS, 0));
    return kTestNow_ms;
  };
  ServiceOptions options;
  options.fusion.workers = 1;
  options.fusion.nice = 3;
  service_ = std::make_unique<AtlasService>(
      *store_, clock, [](LogLevel, const std::string&) {}, options);
  UploadDrive(1);
  Digest();
  EXPECT_EQ(nicest, std::min(ours + 3, 19));
  EXPECT_EQ(::getpriority(PRIO_PROCESS, 0), ours);
  service_.reset();
}

TEST_F(FusionPriorityTest, WithoutWorkersUploadsAreTakenAndWait) {
  Open(0);
  UploadDrive(2);
  EXPECT_GT(service_->ReadStatus()->counts.dirty_tiles, 0u);
  EXPECT_EQ(service_->ReadStatus()->tiles_built, 0u);
}

}  // namespace
}  // namespace atlas
