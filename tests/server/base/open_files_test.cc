#include "server/base/open_files.h"

#include <gtest/gtest.h>
#include <sys/resource.h>

namespace atlas {
namespace {

rlimit LimitNow() {
  rlimit limit{};
  EXPECT_EQ(::getrlimit(RLIMIT_NOFILE, &limit), 0);
  return limit;
}

TEST(OpenFilesTest, AsManyAsTheSystemAllowsAndNeverFewerThanBefore) {
  const rlimit original = LimitNow();
  ASSERT_GE(original.rlim_max, 200u);
  rlimit soft_only = original;
  soft_only.rlim_cur = 100;
  ASSERT_EQ(::setrlimit(RLIMIT_NOFILE, &soft_only), 0);
  EXPECT_EQ(AllowOpenFiles(50), 100u);
  EXPECT_EQ(AllowOpenFiles(150), 150u);
  EXPECT_EQ(LimitNow().rlim_cur, 150u);
  EXPECT_EQ(AllowOpenFiles(std::size_t{1} << 40), original.rlim_max);
  ASSERT_EQ(::setrlimit(RLIMIT_NOFILE, &original), 0);
}

}  // namespace
}  // namespace atlas
