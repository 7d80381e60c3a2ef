// A store whose files are looked at, altered and put back as a kill would leave them, and what it
// says then.
#pragma once

#include <algorithm>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <map>
#include <string>

#include "server/store/sqlite/revision_note.h"
#include "tests/server/store/backup_fixture.h"

namespace atlas {

inline Bytes ReadFile(const std::filesystem::path& path) {
  std::ifstream in(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>()};
}

inline void WriteFile(const std::filesystem::path& path, const Bytes& bytes) {
  std::ofstream out(path, std::ios::binary);
  out.write(reinterpret_cast<const char*>(bytes.data()),
            static_cast<std::streamsize>(bytes.size()));
}

class MissingCommitsTest : public BackupTest {
 protected:
  using Files = std::map<std::string, Bytes>;

  MissingCommitsTest() {
    options_.on_damaged_log = [this](const std::string& what) {
      told_ = what;
    };
  }

  void PutMany(std::uint32_t first, std::uint32_t count) {
    for (std::uint32_t i = first; i < first + count; ++i) {
      const auto put = Put(Keyframe(i));
      ASSERT_TRUE(put) << put.error().message();
    }
  }
  std::filesystem::path Note() const { return NoteOf(Database()); }
  std::filesystem::path Log() const { return Database().string() + "-wal"; }
  // What a kill leaves.
  Files Look() const {
    Files files;
    for (const std::filesystem::path& file : {Database(), Log(), Note()}) {
      if (std::filesystem::exists(file) && std::filesystem::file_size(file) > 0) {
        files[file.filename().string()] = ReadFile(file);
      }
    }
    return files;
  }
  void PutThere(const Files& files) {
    store_.reset();
    told_.clear();
    std::filesystem::remove_all(options_.directory);
    std::filesystem::create_directories(options_.directory);
    for (const auto& [name, bytes] : files) {
      WriteFile(options_.directory / name, bytes);
    }
  }
  std::uint64_t Losses() {
    const auto events = store_->ListEvents(0, 1'000).value();
    return static_cast<std::uint64_t>(
        std::count_if(events.begin(), events.end(),
                      [](const Event& event) { return event.kind == EventKind::kLogDamaged; }));
  }
  // Of what was at `lost` before; and it goes on.
  void ExpectNoticed(const NotedRevision& lost) {
    EXPECT_NE(told_.find("commits are missing"), std::string::npos) << told_;
    EXPECT_EQ(Losses(), 1U);
    EXPECT_GT(store_->identity().epoch, lost.epoch);
    EXPECT_GT(LineOf(store_->revision()), LineOf(lost.revision));
    EXPECT_EQ(store_->CheckRevision(lost.revision).code(), StatusCode::kNotFound);
    EXPECT_TRUE(Put(Keyframe(1'000)));
    const Status counted = store_->CheckCounters();
    EXPECT_TRUE(counted.ok()) << counted.message();
    told_.clear();
    Open();
    EXPECT_TRUE(told_.empty()) << "once is enough: " << told_;
  }
  void ExpectNothingMissing() {
    EXPECT_TRUE(told_.empty()) << told_;
    EXPECT_EQ(Losses(), 0U);
  }

  std::string told_;
};

}  // namespace atlas
