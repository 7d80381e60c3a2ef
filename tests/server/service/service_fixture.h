// A service over a store of its own, and a small made-up drive to feed it.
#pragma once

#include <algorithm>
#include <atomic>
#include <cstdlib>
#include <filesystem>
#include <memory>
#include <mutex>
#include <random>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "core/keyframe/keyframe_codec.h"
#include "server/service/atlas_service.h"
#include "server/store/await.h"
#include "server/store/sqlite/sqlite_store.h"
#include "tests/core/support/keyframe_worlds.h"

namespace atlas {

inline constexpr std::int64_t kTestNow_ms = 1'700'000'000'000;

inline MapProfile TestProfile() {
  MapProfile profile;
  profile.cell_size_um = 200'000;
  profile.tile_cells = 16;  // 3.2 m
  profile.levels = 4;
  return profile;
}

inline QuantizedPose PoseOf(const testing::MapPose& map_pose) {
  Pose pose = Pose::Identity();
  pose.rotate(Eigen::AngleAxisd(map_pose.yaw_deg * 0.017453292519943295, Eigen::Vector3d::UnitZ()));
  pose.translation() = Eigen::Vector3d(map_pose.x_m, map_pose.y_m, map_pose.z_m);
  return QuantizedPose::FromPose(pose);
}

// Keyframe `i` of a drive along a bent road.
inline testing::MapPose PoseAlong(std::uint32_t i) {
  return {1.5 * i - 6.0, 0.02 * i * i, 1.8, 3.0 * i};
}

inline UploadRequest DriveUpload(std::uint32_t i,
                                 const std::string& session = "day",
                                 const MapProfile& profile = TestProfile()) {
  UploadRequest request;
  request.key = {{"bus", session}, i};
  request.time_ms = 1'000 + 100 * std::int64_t{i};
  request.pose = PoseOf(PoseAlong(i));
  request.blob = EncodeKeyframe(testing::StreetKeyframe(profile, 24, 100 + i));
  return request;
}

class ServiceTest : public ::testing::Test {
 protected:
  void Note(const std::string& line) {
    const std::lock_guard lock(log_mutex_);
    log_ += line + "\n";
  }
  ServiceTest() {
    std::string name = (std::filesystem::temp_directory_path() / "atlas_service_XXXXXX").string();
    if (mkdtemp(name.data()) == nullptr) {
      throw std::runtime_error("cannot make " + name);
    }
    directory_ = name;
  }
  ~ServiceTest() override {
    Close();
    std::error_code ignored;
    std::filesystem::remove_all(directory_, ignored);
  }

  void Open(unsigned workers = 2, const std::string& name = "data") {
    OpenStore(name);
    if (store_) {
      Serve(workers);
    }
  }
  void OpenStore(const std::string& name = "data") {
    Close();
    SqliteStoreOptions options;
    options.directory = directory_ / name;
    options.new_profile = profile_;
    options.max_queued_writes = max_queued_writes_;
    auto store = OpenSqliteStore(options);
    ASSERT_TRUE(store.has_value()) << store.error().message();
    store_ = std::move(*store);
  }
  // The store that is open.
  void Serve(unsigned workers) {
    ServiceOptions service;
    service.fusion.workers = workers;
    // Less than the drive, as a rule: caches must not matter.
    service.fusion.building.keyframe_bytes = 1u << 20;
    service.fusion.building.surveys = surveys_;
    service.fusion.building.survey_files = survey_files_;
    service.past_cache_bytes = 1u << 20;
    service.scratch_directory = directory_;
    service.backup = backups_;
    service.retention = retention_;
    service.compaction = compaction_;
    service.plausibility = plausibility_;
    service_ = std::make_unique<AtlasService>(
        *store_, [this] { return now_ms_.load(); },
        [this](LogLevel, const std::string& line) { Note(line); }, service);
  }
  // What the service said, line by line.
  std::string Log() {
    const std::lock_guard lock(log_mutex_);
    return log_;
  }
  void Close() {
    service_.reset();
    store_.reset();
  }

  Result<PutKeyframeResult> Upload(UploadRequest request) {
    return Await<PutKeyframeResult>(
        [&](auto done) { service_->Upload(std::move(request), std::move(done)); });
  }
  Result<PoseBatchResult> Move(std::vector<PoseBatchRequest::Update> updates) {
    return Await<PoseBatchResult>([&](auto done) {
      service_->UpdatePoses({std::move(updates), "tester", 0}, std::move(done));
    });
  }
  Result<SessionChangeResult> Change(const std::string& session, SessionAction action) {
    return Change(SessionKey{"bus", session}, action);
  }
  Result<SessionChangeResult> Change(const SessionKey& session, SessionAction action) {
    return Await<SessionChangeResult>([&](auto done) {
      service_->ChangeSession({session, action, "tester", "why not"}, std::move(done));
    });
  }
  static Patience Long() { return {std::chrono::seconds(60), {}}; }
  AtlasDigest Digest() {
    auto digest = service_->Digest(Long());
    EXPECT_TRUE(digest.has_value()) << digest.error().message();
    return digest.value_or(AtlasDigest());
  }
  AtlasDigest DigestAt(std::uint64_t revision) {
    auto digest = service_->DigestAt(revision, Long());
    EXPECT_TRUE(digest.has_value()) << digest.error().message();
    return digest.value_or(AtlasDigest());
  }
  void UploadDrive(std::uint32_t count) {
    for (std::uint32_t i = 0; i < count; ++i) {
      const auto put = Upload(DriveUpload(i));
      ASSERT_TRUE(put.has_value()) << put.error().message();
    }
  }

  MapProfile profile_ = TestProfile();  // of new atlases
  std::size_t max_queued_writes_ = SqliteStoreOptions().max_queued_writes;
  SurveyCacheLimits surveys_{100'000, 100'000};
  SurveyFilesOptions survey_files_;  // none
  BackupOptions backups_;            // none
  Retention retention_;              // no limits
  AutomaticCompactionOptions compaction_;
  PlausibilityLimits plausibility_;
  std::filesystem::path directory_;
  std::atomic<std::int64_t> now_ms_{kTestNow_ms};
  std::mutex log_mutex_;
  std::string log_;
  std::unique_ptr<AtlasStore> store_;
  std::unique_ptr<AtlasService> service_;
};

}  // namespace atlas
