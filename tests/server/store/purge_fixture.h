// A store with two sessions, of which one is to be purged, and what is left of it in the files.
#pragma once

#include <algorithm>
#include <chrono>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>
#include <thread>

#include "tests/server/store/store_fixture.h"

namespace atlas {

class PurgeTest : public StoreTest {
 protected:
  static constexpr std::uint32_t kCount = 4;

  // Another process that reads what was before: the log is not emptied until it ends, nor when the
  // store is closed while it is there.
  class Reader {
   public:
    explicit Reader(const std::filesystem::path& database) {
      EXPECT_EQ(sqlite3_open(database.c_str(), &db_), SQLITE_OK);
      Run("BEGIN; SELECT count(*) FROM meta");
    }
    ~Reader() { sqlite3_close(db_); }
    Reader(const Reader&) = delete;
    Reader& operator=(const Reader&) = delete;

    void Run(const char* sql) {
      EXPECT_EQ(sqlite3_exec(db_, sql, nullptr, nullptr, nullptr), SQLITE_OK) << sql;
    }

   private:
    sqlite3* db_ = nullptr;
  };

  static SessionKey Day() { return {"bus", "day"}; }
  static std::string Secret() { return "what nobody is to find"; }
  // Larger than a page, so that most of the blob is in pages of its own.
  static NewKeyframe Large(std::uint32_t sequence,
                           const std::string& session = "day",
                           const std::string& text = Secret()) {
    NewKeyframe keyframe = MakeKeyframe(sequence, {TileId{0, int(sequence % 2), 0}});
    keyframe.key.session.session = session;
    keyframe.blob.clear();
    while (keyframe.blob.size() < 30'000) {
      keyframe.blob.insert(keyframe.blob.end(), text.begin(), text.end());
      keyframe.blob.push_back(static_cast<std::uint8_t>(sequence));
    }
    return keyframe;
  }
  void Fill() {
    Open();
    for (std::uint32_t i = 1; i <= kCount; ++i) {
      ASSERT_TRUE(Put(Large(i)).has_value());
      ASSERT_TRUE(Put(Large(i, "night", "of the night")).has_value());
    }
  }
  Result<SessionChangeResult> Change(SessionAction action, const SessionKey& key = Day()) {
    return Await<SessionChangeResult>([&](auto done) {
      store_->ChangeSession({key, action, "tester", "asked for"}, std::move(done));
    });
  }
  // How often a text is in the database and its log.
  std::size_t InTheFiles(const std::string& text) const {
    std::size_t found = 0;
    for (const char* suffix : {"", "-wal"}) {
      std::ifstream file(Database().string() + suffix, std::ios::binary);
      const std::string all((std::istreambuf_iterator<char>(file)), {});
      for (std::size_t at = all.find(text); at != std::string::npos; at = all.find(text, at + 1)) {
        ++found;
      }
    }
    return found;
  }
  // The log is emptied beside who goes on.
  bool IsSoonGone(const std::string& text) const {
    const auto latest = std::chrono::steady_clock::now() + std::chrono::seconds(60);
    while (InTheFiles(text) > 0 && std::chrono::steady_clock::now() < latest) {
      std::this_thread::sleep_for(std::chrono::milliseconds(5));
    }
    return InTheFiles(text) == 0;
  }
  void ExpectSound() {
    for (const char* session : {"day", "night"}) {
      const Status checked = store_->CheckSession({"bus", session});
      EXPECT_TRUE(checked.ok()) << checked.message();
    }
    const Status counters = store_->CheckCounters();
    EXPECT_TRUE(counters.ok()) << counters.message();
    const Status compactions = store_->CheckCompactions();
    EXPECT_TRUE(compactions.ok()) << compactions.message();
    const auto ids = store_->ListKeyframeIds(0, 1'000).value();
    for (const std::int64_t id : ids) {
      const auto read = store_->ReadKeyframe(id);
      EXPECT_TRUE(read.has_value()) << read.error().message();
    }
  }
};

}  // namespace atlas
