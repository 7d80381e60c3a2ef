// Plays a script against a store and a service in a directory of its own, and the same against the
// model; says where they differ first. For one thread.
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "server/service/atlas_service.h"
#include "server/store/atlas_store.h"
#include "tests/server/service/property/atlas_script.h"
#include "tests/server/service/property/model_atlas.h"

namespace atlas::testing {

// What was put to the test.
struct PlayCounts {
  std::uint64_t cases = 0;
  std::uint64_t steps = 0;
  std::uint64_t compared = 0;       // digests
  std::uint64_t compared_past = 0;  // digests of earlier revisions
  std::uint64_t tiles = 0;          // in the compared digests
  std::uint64_t reopened = 0;
  std::uint64_t refused = 0;  // uploads, pose batches and compactions, as they should be
  std::uint64_t compacted = 0;
  std::uint64_t dropped = 0;  // keyframes
};

class AtlasPlayer {
 public:
  // `directory`: empty or missing; it is removed afterwards.
  AtlasPlayer(const AtlasScript& script, std::filesystem::path directory, PlayCounts& counts);
  AtlasPlayer(const AtlasPlayer&) = delete;
  AtlasPlayer& operator=(const AtlasPlayer&) = delete;
  ~AtlasPlayer();

  // Empty when all is as it should be.
  std::string Play();

 private:
  struct TileState {
    std::uint64_t revision = 0;
    std::uint64_t payload_hash = 0;
  };
  struct Note {
    std::uint64_t revision = 0;
    std::array<std::uint8_t, 32> sha256{};
  };

  void Open(const DaemonSetup& setup);
  void Close();
  void PlayStep(const Step& step);
  void Upload(const Placing& placing);
  void UploadTwice(const std::vector<Placing>& placings);
  void MovePoses(const std::vector<Placing>& placings);
  void ChangeSession(const Step& step);
  void Compact(const Step& step);
  void AwaitAnswers();
  void Compare();
  void CompareTiles(const ModelAtlas::Payloads& expected);
  void CheckLocality();
  void TakeNote();
  void CompareNotes();
  void Verify();

  UploadRequest RequestOf(const Placing& placing) const;
  // True, and written down, when `is_wrong` and nothing was before.
  bool Fail(bool is_wrong, const std::function<std::string()>& what);
  template <typename T>
  bool CheckAnswer(const char* what, const Result<T>& answer, const Result<T>& expected);

  const AtlasScript& script_;
  std::filesystem::path directory_;
  PlayCounts& counts_;
  ModelAtlas model_;
  std::unique_ptr<AtlasStore> store_;
  std::unique_ptr<AtlasService> service_;
  std::vector<std::function<void()>> unanswered_;
  std::map<std::uint64_t, TileState> tiles_;  // when they were compared last
  std::vector<Note> notes_;
  std::uint64_t horizon_ = 0;
  std::string failure_;
};

}  // namespace atlas::testing
