// A spool in a test's hand: keyframes to put, and a daemon to send them to.
#pragma once

#include <algorithm>
#include <chrono>
#include <filesystem>
#include <map>
#include <mutex>
#include <string>
#include <utility>
#include <vector>

#include "client/vehicle/upload_spool.h"
#include "proto/wire/convert.h"
#include "tests/client/support/test_peer.h"
#include "tests/client/vehicle/test_folder.h"

namespace atlas {

namespace fs = std::filesystem;

// A daemon that remembers the sequence numbers it took, refuses as told, and leaves after so many.
class UploadPeer {
 public:
  explicit UploadPeer(std::map<std::uint32_t, Status> refusals = {},
                      int answers = 1 << 30,
                      PeerIdentity client = {},
                      PeerAtlas atlas = {})
      : refusals_(std::move(refusals)),
        answers_(answers),
        client_(std::move(client)),
        atlas_(std::move(atlas)),
        peer_([this](PeerSocket& socket) { Serve(socket); }) {}

  Result<SpoolReport> Take(UploadSpool& spool) {
    auto client = AtlasClient::Connect(peer_.options());
    return client ? spool.Send(*client, {.deadline = std::chrono::minutes(2)})
                  : Result<SpoolReport>(Error(client.error()));
  }
  std::vector<std::uint32_t> came() {
    const std::lock_guard lock(mutex_);
    return came_;
  }

 private:
  void Serve(PeerSocket& socket) {
    AnswerHello(socket, {}, client_, atlas_);
    while (const auto request = socket.ReadRequest()) {
      if (answers_-- <= 0) return;
      const std::uint32_t sequence = request->upload_keyframe().key().sequence();
      wire::Envelope reply;
      const auto refusal = refusals_.find(sequence);
      if (refusal != refusals_.end()) {
        *reply.mutable_error() = ErrorToWire(refusal->second);
      } else {
        const std::lock_guard lock(mutex_);
        came_.push_back(sequence);
        reply.mutable_upload_reply()->set_revision(1);
      }
      socket.Reply(request->request_id(), std::move(reply));
    }
  }

  std::map<std::uint32_t, Status> refusals_;
  int answers_;
  PeerIdentity client_;
  PeerAtlas atlas_;
  std::mutex mutex_;
  std::vector<std::uint32_t> came_;
  TestPeer peer_;
};

inline Status PutOne(UploadSpool& spool,
                     std::uint32_t sequence,
                     std::size_t bytes = 100,
                     const std::string& vehicle = "car") {
  const Bytes blob(bytes, static_cast<std::uint8_t>(sequence));
  KeyframeUpload upload;
  upload.key = {{vehicle, "monday"}, sequence};
  upload.time_ms = 1'000 + sequence;
  upload.blob = blob;
  return spool.Put(upload);
}

inline UploadSpool OpenSpool(const TestFolder& folder, std::uint64_t max_bytes = 1U << 30U) {
  SpoolOptions options;
  options.folder = folder.path();
  options.max_bytes = max_bytes;
  return *UploadSpool::Open(options);
}

// As the next run of the program finds it.
inline UploadSpool Reopen(UploadSpool& spool,
                          const TestFolder& folder,
                          std::uint64_t max_bytes = 1U << 30U) {
  { const UploadSpool closed = std::move(spool); }
  return OpenSpool(folder, max_bytes);
}

inline std::vector<std::uint32_t> UpTo(std::uint32_t count) {
  std::vector<std::uint32_t> numbers;
  for (std::uint32_t i = 0; i < count; ++i) {
    numbers.push_back(i);
  }
  return numbers;
}

// But for those that are no keyframes.
inline std::vector<fs::path> FilesOf(const fs::path& folder) {
  std::vector<fs::path> paths;
  for (const auto& entry : fs::directory_iterator(folder)) {
    const fs::path name = entry.path().filename();
    if (entry.is_regular_file() && name != "lock" && name != kSentAtlasFileName)
      paths.push_back(entry.path());
  }
  std::sort(paths.begin(), paths.end());
  return paths;
}

}  // namespace atlas
