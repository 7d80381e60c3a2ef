#include "tests/bench/serving/upload_fleet.h"

#include <chrono>
#include <mutex>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "client/connection/atlas_client.h"
#include "client/connection/keyframe_uploader.h"
#include "core/base/str_cat.h"

namespace atlas::testing {
namespace {

using Clock = std::chrono::steady_clock;

double SecondsSince(Clock::time_point begin) {
  return std::chrono::duration<double>(Clock::now() - begin).count();
}

class Fleet {
 public:
  Fleet(std::span<const StoredUpload> uploads, const FleetOptions& options)
      : uploads_(uploads), options_(options) {}

  Result<UploadFigures> Run(const std::function<void()>& on_ready) {
    if (Status status = Connect(); !status.ok()) {
      return Error(std::move(status));
    }
    on_ready();
    begin_ = Clock::now();
    {
      std::vector<std::jthread> threads;
      for (std::size_t vehicle = 0; vehicle < clients_.size(); ++vehicle) {
        threads.emplace_back([this, vehicle] { Note(Drive(vehicle)); });
      }
    }
    figures_.seconds = SecondsSince(begin_);
    if (!status_.ok()) {
      return Error(status_);
    }
    return std::move(figures_);
  }

 private:
  Status Connect() {
    for (std::size_t vehicle = 0; vehicle < options_.vehicles; ++vehicle) {
      ConnectionOptions connection;
      connection.endpoint.port = options_.port;
      connection.client_name = StrCat("car.", vehicle);
      auto client = AtlasClient::Connect(connection);
      if (!client) {
        return client.error();
      }
      clients_.push_back(*std::move(client));
    }
    return {};
  }

  Result<UploadFigures> Drive(std::size_t vehicle) {
    KeyframeUploader uploader(clients_[vehicle]);
    UploadFigures figures;
    for (std::size_t i = 0; i < options_.keyframes; ++i) {
      const std::size_t first = vehicle * uploads_.size() / options_.vehicles;
      const StoredUpload& stored = uploads_[(first + i) % uploads_.size()];
      KeyframeUpload upload;
      // Of each drive, and each time that they begin anew: no vehicle leaps from one to the next.
      const std::string session =
          StrCat(options_.session, "-", stored.session, "-", (first + i) / uploads_.size());
      upload.key = {{StrCat("car.", vehicle), session}, static_cast<std::uint32_t>(i)};
      upload.time_ms = stored.time_ms;
      upload.T_world_sensor = stored.T_world_sensor;
      upload.blob = stored.blob;
      figures.bytes += upload.blob.size();
      if (Status status = Send(uploader, upload, vehicle, i, figures); !status.ok()) {
        return Error(std::move(status));
      }
    }
    if (Status status = uploader.Finish(); !status.ok()) {
      return Error(std::move(status));
    }
    figures.keyframes = uploader.totals().acked;
    if (figures.keyframes != options_.keyframes || uploader.totals().duplicates > 0) {
      return Error(StatusCode::kInvalidData, "keyframes were there already, or got lost");
    }
    return figures;
  }

  // With a rate, evenly beside the others, and the answer is waited for.
  Status Send(KeyframeUploader& uploader,
              const KeyframeUpload& upload,
              std::size_t vehicle,
              std::size_t number,
              UploadFigures& figures) const {
    if (options_.per_s <= 0.0) {
      return uploader.Upload(upload);
    }
    const double turn = static_cast<double>(vehicle) / static_cast<double>(options_.vehicles);
    const std::chrono::duration<double> due((static_cast<double>(number) + turn) / options_.per_s);
    std::this_thread::sleep_until(begin_ + std::chrono::duration_cast<Clock::duration>(due));
    const auto sent = Clock::now();
    ATLAS_RETURN_IF_ERROR(uploader.Upload(upload));
    ATLAS_RETURN_IF_ERROR(uploader.Finish());
    figures.acknowledged_ms.push_back(1e3 * SecondsSince(sent));
    return {};
  }

  void Note(Result<UploadFigures> figures) {
    const std::lock_guard lock(mutex_);
    if (!figures) {
      status_ = figures.error();
      return;
    }
    figures_.keyframes += figures->keyframes;
    figures_.bytes += figures->bytes;
    figures_.acknowledged_ms.insert(figures_.acknowledged_ms.end(),
                                    figures->acknowledged_ms.begin(),
                                    figures->acknowledged_ms.end());
  }

  std::span<const StoredUpload> uploads_;
  const FleetOptions& options_;
  std::vector<AtlasClient> clients_;
  Clock::time_point begin_;
  std::mutex mutex_;
  UploadFigures figures_;
  Status status_;
};

}  // namespace

Result<UploadFigures> RunFleet(std::span<const StoredUpload> uploads,
                               const FleetOptions& options,
                               const std::function<void()>& on_ready) {
  return Fleet(uploads, options).Run(on_ready);
}

}  // namespace atlas::testing
