// A small atlas of a few keyframes, with the service of a daemon over it.
#pragma once

#include <memory>

#include "server/service/atlas_service.h"
#include "tests/fuzz/support/scratch_folder.h"

namespace atlas::fuzz {

class TinyAtlas {
 public:
  static MapProfile Profile();
  static constexpr std::int64_t kNow_ms = 1'700'000'000'000;

  TinyAtlas();

  AtlasService& service() { return *service_; }
  // The bytes of its file. Nothing else may be called then.
  Bytes Close();

 private:
  ScratchFolder folder_;
  std::unique_ptr<AtlasStore> store_;
  std::unique_ptr<AtlasService> service_;
};

}  // namespace atlas::fuzz
