// Names of hosts, with a resolver that takes as long as it likes.
#include "client/connection/name_lookup.h"

#include <gtest/gtest.h>

#include "tests/client/support/gated_resolver.h"

namespace atlas {
namespace {

using Clock = std::chrono::steady_clock;
using std::chrono::milliseconds;
using Addresses = NameLookup::Addresses;

// Far more than an answer that is there takes.
const milliseconds kLong{20'000};

TEST(NameLookupTest, AnAddressIsItsOwnAnswerAndNobodyIsAsked) {
  const GatedResolver silent;
  NameLookup names(silent.resolver());
  for (const std::string address : {"127.0.0.1", "::1", "fe80::1%1"}) {
    const auto found = names.Find(address, Clock::now());
    ASSERT_TRUE(found) << address;
    EXPECT_EQ(*found, Addresses{address});
  }
  EXPECT_TRUE(silent.asked().empty());
}

TEST(NameLookupTest, AQuestionOutlivesItsAskerAndIsAskedOnce) {
  GatedResolver resolver;
  NameLookup names(resolver.resolver());
  for (int call = 0; call < 20; ++call) {
    const auto found = names.Find("daemon", Clock::now() + milliseconds(1));
    ASSERT_TRUE(found);
    EXPECT_FALSE(*found);
  }
  resolver.Answer(Addresses{"192.0.2.1", "2001:db8::1"});
  EXPECT_EQ(*names.Find("daemon", Clock::now() + kLong), (Addresses{"192.0.2.1", "2001:db8::1"}));
  EXPECT_EQ(resolver.asked(), std::vector<std::string>{"daemon"});
  // An answer is told once: what it was may have changed since.
  EXPECT_TRUE(*names.Find("daemon", Clock::now() + kLong));
  EXPECT_EQ(resolver.asked().size(), 2U);
}

TEST(NameLookupTest, OneQuestionAtATime) {
  GatedResolver resolver;
  NameLookup names(resolver.resolver());
  EXPECT_FALSE(*names.Find("one", Clock::now() + milliseconds(1)));
  EXPECT_FALSE(*names.Find("other", Clock::now() + milliseconds(1)));
  resolver.Answer(Addresses{"192.0.2.1"});
  EXPECT_TRUE(*names.Find("other", Clock::now() + kLong));
  EXPECT_EQ(resolver.asked(), (std::vector<std::string>{"one", "other"}));
}

TEST(NameLookupTest, AFailureIsToldAndAskedAnew) {
  GatedResolver resolver;
  resolver.Answer(Error(StatusCode::kUnavailable, "no such host"));
  NameLookup names(resolver.resolver());
  const auto found = names.Find("daemon", Clock::now() + kLong);
  ASSERT_FALSE(found);
  EXPECT_EQ(found.error().message(), "no such host");
  resolver.Answer(Addresses{"192.0.2.1"});
  EXPECT_TRUE(names.Find("daemon", Clock::now() + kLong));
}

TEST(NameLookupTest, AnAbandonedQuestionHoldsNobody) {
  const GatedResolver silent;
  {
    NameLookup names(silent.resolver());
    EXPECT_FALSE(*names.Find("daemon", Clock::now() + milliseconds(1)));
  }
  SUCCEED() << "the lookup is gone, its question is not";
}

TEST(NameLookupTest, TheSystemKnowsThisMachine) {
  const auto found = NameLookup::AskSystem("localhost");
  ASSERT_TRUE(found) << found.error().message();
  EXPECT_FALSE(found->empty());
  const auto unknown = NameLookup::AskSystem("a name with spaces");
  ASSERT_FALSE(unknown);
  EXPECT_EQ(unknown.error().code(), StatusCode::kUnavailable);
}

}  // namespace
}  // namespace atlas
