// A drive whose rows are spoiled under a service.
#pragma once

#include <algorithm>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <sqlite3.h>

#include "tests/server/service/service_fixture.h"

namespace atlas {

inline constexpr std::uint32_t kDrive = 8;

class DamageTest : public ServiceTest {
 protected:
  DamageTest() { surveys_ = {0, 0}; }  // what was read once must not hide it

  void Tamper(const std::string& sql) {
    Close();
    sqlite3* db = nullptr;
    ASSERT_EQ(sqlite3_open((directory_ / "data" / "atlas.db").c_str(), &db), SQLITE_OK);
    char* message = nullptr;
    EXPECT_EQ(sqlite3_exec(db, sql.c_str(), nullptr, nullptr, &message), SQLITE_OK) << message;
    sqlite3_close(db);
    Open(1);
  }
  void Fill() {
    Open(1);
    UploadDrive(kDrive);
    intact_ = Digest();
  }
  // As if the keyframes without `left_out` had been all.
  AtlasDigest DigestWithout(std::uint32_t left_out) {
    Open(1, "reference");
    for (std::uint32_t i = 0; i < kDrive; ++i) {
      if (i != left_out) {
        EXPECT_TRUE(Upload(DriveUpload(i)));
      }
    }
    return Digest();
  }
  // Has everything fused again that a keyframe touches.
  void Touch(std::uint32_t i) {
    const auto found = store_->FindKeyframes(std::vector{DriveUpload(i).key});
    ASSERT_TRUE(found) << found.error().message();
    Mark(store_->ReadKeyframe(found->at(0)->id).value().footprint);
  }
  void Mark(std::vector<TileId> tiles) {
    ASSERT_TRUE(Await<std::uint32_t>(
        [&](auto done) { store_->MarkDirty(std::move(tiles), std::move(done)); }));
    service_->WaitUntilClean({std::chrono::milliseconds(1), {}});
  }
  Result<VerifyReport> Repair() {
    return service_->Verify({.repair = true, .author = "operator"}, Long());
  }
  std::vector<EventKind> Events() {
    std::vector<EventKind> kinds;
    const auto events = store_->ListEvents(0, 1'000).value();
    for (const Event& event : events) {
      kinds.push_back(event.kind);
    }
    return kinds;
  }
  std::size_t Listed() { return store_->ListDamagedKeyframes()->size(); }

  AtlasDigest intact_;
};

inline constexpr const char* kSpoilBlob =
    "UPDATE keyframes SET blob = zeroblob(blob_bytes) WHERE sequence = 3";

}  // namespace atlas
