#include "core/geometry/keyframe_key.h"

#include <sstream>
#include <string>

#include <gtest/gtest.h>

namespace atlas {
namespace {

TEST(KeyframeKeyTest, AcceptsPlainNamesOnly) {
  EXPECT_TRUE(ValidateName("vehicle", "Van-7_a.b").ok());
  EXPECT_TRUE(ValidateName("vehicle", std::string(64, 'x')).ok());
  for (const std::string& name :
       {std::string(), std::string(65, 'x'), std::string("a/b"), std::string("a b"),
        std::string("\xC3\xA4"), std::string("a\0b", 3)}) {
    const Status status = ValidateName("vehicle", name);
    EXPECT_EQ(status.code(), StatusCode::kInvalidArgument);
    EXPECT_NE(status.message().find("vehicle"), std::string::npos);
  }
}

TEST(KeyframeKeyTest, OrdersByVehicleSessionSequence) {
  const KeyframeKey a{{"a", "z"}, 9};
  const KeyframeKey b{{"b", "a"}, 1};
  const KeyframeKey c{{"b", "a"}, 2};
  EXPECT_LT(a, b);
  EXPECT_LT(b, c);
}

TEST(KeyframeKeyTest, PrintsAsPath) {
  std::ostringstream out;
  out << KeyframeKey{{"van", "drive"}, 12};
  EXPECT_EQ(out.str(), "van/drive/12");
}

TEST(KeyframeKeyTest, AnyTextBecomesAName) {
  EXPECT_EQ(NameFrom("my drive (2)"), "my-drive--2-");
  EXPECT_EQ(NameFrom("2011_09_26-0005.x"), "2011_09_26-0005.x");
  EXPECT_TRUE(ValidateName("session", NameFrom(std::string(200, '\xe4'))).ok());
}

}  // namespace
}  // namespace atlas
