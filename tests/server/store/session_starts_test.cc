// A vehicle begins an hour's worth of sessions at once, and then as many an hour.
#include "server/store/session_starts.h"

#include <atomic>

#include "tests/server/store/faulty_vfs.h"
#include "tests/server/store/store_fixture.h"

namespace atlas {
namespace {

using std::chrono::minutes;
using std::chrono::seconds;

constexpr SessionStarts::Clock::time_point kStart{};

TEST(SessionStartsTest, AnHoursWorthMayBeginAtOnceAndThenAsManyAnHour) {
  SessionStarts starts(6);
  for (int i = 0; i < 6; ++i) {
    EXPECT_TRUE(starts.Begin("bus", kStart + seconds(i))) << i;
  }
  const Status refused = starts.Begin("bus", kStart + minutes(5)).error();
  EXPECT_EQ(refused.code(), StatusCode::kUnavailable);
  EXPECT_NE(refused.message().find("vehicle bus"), std::string::npos);
  EXPECT_NE(refused.message().find("in 300 s"), std::string::npos) << refused.message();
  EXPECT_EQ(refused.retry_after_ms(), 300'000);
  EXPECT_TRUE(starts.Begin("tram", kStart + minutes(5))) << "every vehicle for itself";
  EXPECT_TRUE(starts.Begin("bus", kStart + minutes(10)));
  EXPECT_FALSE(starts.Begin("bus", kStart + minutes(10)));
  int begun = 0;
  for (minutes passed{11}; passed <= minutes(130); ++passed) {
    begun += starts.Begin("bus", kStart + passed) ? 1 : 0;
  }
  EXPECT_EQ(begun, 12) << "in two hours";
}

TEST(SessionStartsTest, TheLimitChangesAndZeroIsNone) {
  SessionStarts starts(1);
  EXPECT_TRUE(starts.Begin("bus", kStart));
  EXPECT_FALSE(starts.Begin("bus", kStart));
  starts.set_per_hour(0);
  EXPECT_TRUE(starts.Begin("bus", kStart));
  starts.set_per_hour(2);
  EXPECT_FALSE(starts.Begin("bus", kStart)) << "what was begun stays counted";
  EXPECT_TRUE(starts.Begin("bus", kStart + minutes(30)));
}

TEST(SessionStartsTest, IsBounded) {
  SessionStarts starts(1'000);
  for (std::size_t i = 0; i < 3 * SessionStarts::kMaxVehicles; ++i) {
    ASSERT_TRUE(starts.Begin("bus-" + std::to_string(i), kStart));
    ASSERT_LE(starts.vehicles(), SessionStarts::kMaxVehicles);
  }
}

// With those that count no more, no other is forgotten.
TEST(SessionStartsTest, ForgetsWhoIsRestedFirst) {
  SessionStarts starts(1);
  for (std::size_t i = 0; i < SessionStarts::kMaxVehicles - 1; ++i) {
    ASSERT_TRUE(starts.Begin("bus-" + std::to_string(i), kStart));
  }
  ASSERT_TRUE(starts.Begin("late", kStart + minutes(30)));
  ASSERT_TRUE(starts.Begin("another", kStart + minutes(61)));
  EXPECT_EQ(starts.vehicles(), 2u);
  EXPECT_FALSE(starts.Begin("late", kStart + minutes(61)));
}

TEST(SessionStartsTest, OnlyWhatBecameOfAnUploadThatFailedIsGivenBack) {
  const auto starts = std::make_shared<SessionStarts>(1);
  SessionStart failed(starts);
  ASSERT_TRUE(failed.Begin("bus", kStart).ok());
  EXPECT_TRUE(failed.Begin("bus", kStart).ok()) << "its write is made once more: counted once";
  EXPECT_FALSE(SessionStart(starts).Begin("bus", kStart).ok()) << "counted at once";
  SessionStart never_begun(starts);
  never_begun.NoteEnd({StatusCode::kUnavailable, "another reason"});
  EXPECT_FALSE(SessionStart(starts).Begin("bus", kStart).ok());
  starts->set_per_hour(4);
  failed.NoteEnd({StatusCode::kResourceExhausted, "a full disk"});
  starts->set_per_hour(1);
  SessionStart done(starts);
  EXPECT_TRUE(done.Begin("bus", kStart).ok()) << "all that it counted for";
  done.NoteEnd({});
  EXPECT_FALSE(SessionStart(starts).Begin("bus", kStart).ok());
}

class SessionsStoreTest : public StoreTest {
 protected:
  Result<PutKeyframeResult> PutInto(const SessionKey& session, std::uint32_t sequence = 1) {
    NewKeyframe keyframe = MakeKeyframe(sequence, {{0, 1, 2}});
    keyframe.key.session = session;
    keyframe.start = starts_ == nullptr ? nullptr : std::make_shared<SessionStart>(starts_);
    return Put(std::move(keyframe));
  }
  // So many sessions of a bus at once, each of one keyframe. How many began.
  int BeginTogether(int count) {
    std::atomic<int> begun = 0;
    for (int i = 0; i < count; ++i) {
      NewKeyframe keyframe = MakeKeyframe(1, {{0, 1, 2}});
      keyframe.key.session = {"bus", "s" + std::to_string(i)};
      keyframe.start = std::make_shared<SessionStart>(starts_);
      store_->PutKeyframe(std::move(keyframe),
                          [&begun](const Result<PutKeyframeResult>& put) { begun += put ? 1 : 0; });
    }
    store_->Flush();
    return begun;
  }
  // "vehicle/session", page by page.
  std::vector<std::string> PagesOf(std::uint32_t limit) {
    std::vector<std::string> names;
    SessionKey after;
    while (true) {
      const auto page = store_->ListSessions(after, limit);
      EXPECT_TRUE(page.has_value()) << page.error().message();
      if (!page || page->empty()) {
        return names;
      }
      EXPECT_LE(page->size(), limit);
      for (const SessionRecord& session : *page) {
        names.push_back(session.key.vehicle + "/" + session.key.session);
      }
      after = page->back().key;
    }
  }

  std::shared_ptr<SessionStarts> starts_ = std::make_shared<SessionStarts>(2);
};

TEST_F(SessionsStoreTest, OneThatMayNotBeginLeavesNothing) {
  Open();
  ASSERT_TRUE(PutInto({"bus", "a"}));
  ASSERT_TRUE(PutInto({"bus", "b"}));
  const auto refused = PutInto({"bus", "c"});
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().code(), StatusCode::kUnavailable);
  EXPECT_EQ(store_->ReadCounts()->sessions, 2u);
  EXPECT_EQ(PagesOf(10), (std::vector<std::string>{"bus/a", "bus/b"}));
  EXPECT_TRUE(PutInto({"bus", "a"}, 2)) << "one that is there goes on";
  EXPECT_TRUE(PutInto({"tram", "c"}));
  EXPECT_EQ(store_->ReadCounts()->sessions, 3u);
}

TEST_F(SessionsStoreTest, TogetherNoMoreBeginThanMay) {
  Open();
  EXPECT_EQ(BeginTogether(20), 2);
  EXPECT_EQ(store_->ReadCounts()->sessions, 2u);
}

class SessionsFaultTest : public SessionsStoreTest {
 protected:
  ~SessionsFaultTest() override { store_.reset(); }  // before the layer that it was opened with

  FaultyVfs vfs_;
};

TEST_F(SessionsFaultTest, WhatDidNotComeToTheDiskIsNotCounted) {
  Open();
  for (int day = 0; day < 5; ++day) {
    vfs_.FailAt(1, FaultyVfs::Calls::kWrite, FaultyVfs::Until::kHealed, true);
    const auto put = PutInto({"bus", "full" + std::to_string(day)});
    ASSERT_FALSE(put);
    EXPECT_EQ(put.error().code(), StatusCode::kResourceExhausted) << put.error().message();
    EXPECT_EQ(BeginTogether(20), 0);
    ASSERT_TRUE(vfs_.Heal());
  }
  EXPECT_TRUE(PutInto({"bus", "a"}));
  EXPECT_TRUE(PutInto({"bus", "b"}));
  EXPECT_EQ(PutInto({"bus", "c"}).error().code(), StatusCode::kUnavailable);
  EXPECT_EQ(PagesOf(10), (std::vector<std::string>{"bus/a", "bus/b"}));
}

TEST_F(SessionsStoreTest, PagesAreInOrderWhateverTheirSize) {
  starts_ = nullptr;
  Open();
  const std::vector<SessionKey> keys = {{"b", "2"}, {"a", "9"}, {"b", "10"}, {"ab", "1"},
                                        {"a", "1"}, {"B", "z"}, {"b", "1"}};
  for (const SessionKey& key : keys) {
    ASSERT_TRUE(PutInto(key));
  }
  const std::vector<std::string> all = {"B/z", "a/1", "a/9", "ab/1", "b/1", "b/10", "b/2"};
  for (const std::uint32_t limit : {1u, 2u, 3u, 7u, 8u}) {
    EXPECT_EQ(PagesOf(limit), all) << limit;
  }
  // Behind one that is not there.
  EXPECT_EQ(store_->ListSessions({"a", "5"}, 1)->at(0).key, (SessionKey{"a", "9"}));
  EXPECT_EQ(store_->ListSessions({"aa", ""}, 1)->at(0).key, (SessionKey{"ab", "1"}));
  EXPECT_TRUE(store_->ListSessions({"c", ""}, 1)->empty());
}

// More than are read at a time.
TEST_F(SessionsStoreTest, AVehicleOfManySessionsChangesAsOne) {
  Open();
  starts_ = nullptr;
  constexpr std::uint32_t kMany = 600;
  for (std::uint32_t i = 0; i < kMany; ++i) {
    NewKeyframe keyframe = MakeKeyframe(1, {{0, 1, 2}});
    keyframe.key.session = {"bus", std::to_string(i)};
    store_->PutKeyframe(std::move(keyframe), [](const Result<PutKeyframeResult>& put) {
      EXPECT_TRUE(put) << put.error().message();
    });
  }
  ASSERT_TRUE(PutInto({"tram", "1"}));
  const auto changed = Await<SessionChangeResult>([&](auto done) {
    store_->ChangeSession({{"bus", ""}, SessionAction::kRetract, "tester", ""}, std::move(done));
  });
  ASSERT_TRUE(changed) << changed.error().message();
  EXPECT_EQ(changed->sessions, kMany);
  EXPECT_EQ(changed->tiles_marked, kMany);
  const auto sessions = store_->ListSessions({}, 2 * kMany);
  std::uint32_t retracted = 0;
  for (const SessionRecord& session : *sessions) {
    retracted += session.state == SessionState::kRetracted ? 1u : 0u;
  }
  EXPECT_EQ(retracted, kMany);
  EXPECT_EQ(sessions->size(), kMany + 1);
}

// Whoever goes on behind the last one of a page would go round in circles.
TEST_F(SessionsStoreTest, AnIndexInAnotherOrderIsDamage) {
  Open();
  starts_ = nullptr;
  for (const char* const session : {"a", "b", "c", "d"}) {
    ASSERT_TRUE(PutInto({"bus", session}));
  }
  Tamper(
      "CREATE TABLE other (id INTEGER PRIMARY KEY, vehicle TEXT, session TEXT, "
      "UNIQUE (vehicle, session DESC));"
      "INSERT INTO other SELECT id, vehicle, session FROM sessions;"
      "PRAGMA writable_schema = ON;"
      "UPDATE sqlite_schema SET rootpage = "
      "(SELECT sum(rootpage) FROM sqlite_schema WHERE name IN "
      "('sqlite_autoindex_sessions_1', 'sqlite_autoindex_other_1')) - rootpage "
      "WHERE name IN ('sqlite_autoindex_sessions_1', 'sqlite_autoindex_other_1');");
  Open();
  const auto page = store_->ListSessions({}, 3);
  ASSERT_FALSE(page);
  EXPECT_EQ(page.error().code(), StatusCode::kInvalidData);
  EXPECT_NE(page.error().message().find("index of sessions"), std::string::npos)
      << page.error().message();
  const auto changed = Await<SessionChangeResult>([&](auto done) {
    store_->ChangeSession({{"bus", ""}, SessionAction::kRetract, "tester", ""}, std::move(done));
  });
  ASSERT_FALSE(changed);
  EXPECT_EQ(changed.error().code(), StatusCode::kInvalidData);
}

}  // namespace
}  // namespace atlas
