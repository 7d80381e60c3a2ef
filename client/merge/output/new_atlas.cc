#include "client/merge/output/new_atlas.h"

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <cstdio>
#include <utility>

#include <fcntl.h>
#include <unistd.h>

#include "client/atlas_file/backup_restore.h"
#include "client/merge/output/making_folder.h"
#include "client/merge/output/own_daemon.h"
#include "core/base/disk_error.h"
#include "core/base/str_cat.h"

namespace atlas {
namespace {

namespace fs = std::filesystem;

constexpr const char* kName = "merged.db";  // of the copy, until it stands at its place
constexpr std::size_t kWhole = 1'000;       // of a step that counts bytes

std::size_t PartOf(std::uint64_t done, std::uint64_t all) {
  const double part = all == 0 ? 1.0 : static_cast<double>(done) / static_cast<double>(all);
  return static_cast<std::size_t>(part * kWhole);
}

fs::path FolderOf(const fs::path& target) {
  return target.has_parent_path() ? target.parent_path() : fs::path(".");
}

Status CheckTarget(const fs::path& target) {
  std::error_code error;
  if (!fs::exists(fs::symlink_status(target, error))) return {};
  return {StatusCode::kConflict,
          StrCat(target.string(), " is there already: a new atlas replaces no file")};
}

Status CopyBase(const fs::path& base, const fs::path& data, const NewAtlas::Progress& progress) {
  Status stop;
  RestorePlan plan{base, data / "atlas.db", false, {}, {}};
  plan.check_stop = [&stop] {
    return stop;
  };
  plan.on_progress = [&](std::uint64_t done, std::uint64_t all) {
    stop = progress("beginning", PartOf(done, all), kWhole);
  };
  const auto restored = RestoreBackup(plan);
  return restored ? Status() : restored.error().WithContext(base.string());
}

// Where nothing stands.
Status MoveTo(const fs::path& from, const fs::path& target) {
  if (::renameat2(AT_FDCWD, from.c_str(), AT_FDCWD, target.c_str(), RENAME_NOREPLACE) != 0) {
    if (errno == EEXIST) return CheckTarget(target);
    return DiskError("cannot write", target, errno);
  }
  const fs::path folder = FolderOf(target);
  const int fd = ::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  const bool is_synced = fd >= 0 && ::fsync(fd) == 0;
  const int error = errno;
  if (fd >= 0) ::close(fd);
  return is_synced ? Status() : DiskError("cannot sync", folder, error);
}

}  // namespace

class NewAtlas::Making {
 public:
  Making(fs::path target,
         std::unique_ptr<MakingFolder> folder,
         OwnDaemon daemon,
         AtlasClient client)
      : target_(std::move(target)),
        folder_(std::move(folder)),
        daemon_(std::move(daemon)),
        client_(std::move(client)) {}

  AtlasClient& client() { return client_; }

  Result<BackupSummary> Finish(const std::string& author, const Progress& progress) {
    constexpr std::chrono::hours kPatience{24};
    Status status = AwaitFusion(progress);
    if (!status.ok()) return Error(std::move(status));
    Result<BackupSummary> done =
        client_.Backup(kName, author, kPatience, [&](const BackupStage& stage) {
          status = progress(stage.is_copied ? "reading back" : "copying",
                            PartOf(stage.done_bytes, stage.total_bytes), kWhole);
        });
    if (!done) return done;
    if (status.ok()) status = daemon_.Stop();
    if (status.ok()) status = MoveTo(folder_->backups() / kName, target_);
    if (!status.ok()) return Error(std::move(status));
    return done;
  }

 private:
  Status AwaitFusion(const Progress& progress) {
    constexpr std::chrono::milliseconds kLook{500};
    std::uint64_t most = 1;
    for (;;) {
      const Result<WaitSummary> done = client_.WaitUntilFused(kLook);
      if (done) return progress("fusing", most, most);
      if (done.error().code() != StatusCode::kTimeout) return done.error();
      const Result<AtlasStatus> now = client_.ReadStatus();
      if (!now) return now.error();
      if (now->damaged_tiles > 0) {
        return {StatusCode::kInvalidData,
                StrCat(now->damaged_tiles,
                       " tiles cannot be fused: `atlas verify` of what was "
                       "merged tells which keyframes are damaged")};
      }
      most = std::max(most, now->dirty_tiles);
      ATLAS_RETURN_IF_ERROR(progress("fusing", most - now->dirty_tiles, most));
    }
  }

  fs::path target_;
  // In this order: the connection goes before the daemon, and that before its folder.
  std::unique_ptr<MakingFolder> folder_;
  OwnDaemon daemon_;
  AtlasClient client_;
};

NewAtlas::NewAtlas(std::unique_ptr<Making> making) : making_(std::move(making)) {}
NewAtlas::NewAtlas(NewAtlas&&) noexcept = default;
NewAtlas& NewAtlas::operator=(NewAtlas&&) noexcept = default;
NewAtlas::~NewAtlas() = default;

Result<NewAtlas> NewAtlas::Begin(const NewAtlasPlan& plan, const Progress& progress) {
  if (Status status = CheckTarget(plan.target); !status.ok()) return Error(std::move(status));
  auto folder = MakingFolder::Make(plan.target);
  if (!folder) return Error(folder.error());
  OwnDaemonOptions options{(*folder)->data(), (*folder)->backups(), std::nullopt};
  if (plan.base) {
    Status status = CopyBase(*plan.base, (*folder)->data(), progress);
    if (!status.ok()) return Error(std::move(status));
  } else {
    options.profile = plan.profile;
  }
  Result<OwnDaemon> daemon = OwnDaemon::Start(options);
  if (!daemon) return Error(daemon.error());
  ConnectionOptions connection;
  connection.endpoint = daemon->endpoint();
  connection.client_name = "atlas-merge";
  Result<AtlasClient> client = AtlasClient::Connect(connection);
  if (!client) return Error(client.error());
  if (!(client->profile() == plan.profile)) {
    return Error(StatusCode::kUnsupported,
                 "no daemon makes a new atlas of this map profile: begin with a copy of one "
                 "(--atlas)");
  }
  return NewAtlas(std::make_unique<Making>(plan.target, *std::move(folder), *std::move(daemon),
                                           *std::move(client)));
}

AtlasClient& NewAtlas::client() {
  return making_->client();
}

Result<BackupSummary> NewAtlas::Finish(const std::string& author, const Progress& progress) {
  return making_->Finish(author, progress);
}

}  // namespace atlas
