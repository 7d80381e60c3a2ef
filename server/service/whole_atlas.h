// What takes the whole atlas: its digest, its verification, its compaction. The first two wait
// until nothing is dirty and are done again when it changed meanwhile, the third waits for what was
// there when it was asked for.
//
// Thread-safe. `patience` bounds all of it, kTimeout; kUnavailable when it is stopped, or the
// daemon ends.
#pragma once

#include <cstdint>
#include <mutex>

#include "core/base/status.h"
#include "server/service/change_signal.h"
#include "server/service/compaction/compact_atlas.h"
#include "server/service/fusion_wait.h"
#include "server/service/verification/atlas_digest.h"
#include "server/service/verification/atlas_verify.h"
#include "server/store/atlas_store.h"

namespace atlas {

class WholeAtlas {
 public:
  WholeAtlas(AtlasStore& store, ChangeSignal& changes, const FusionWait& wait)
      : store_(store), changes_(changes), wait_(wait) {}

  // kInvalidData names the damage that keeps the atlas from becoming clean.
  Result<AtlasDigest> Digest(const Patience& patience) const;
  // `rebuild` waits and reports what is damaged; a plain check does not wait. With `repair` it is
  // verified again after that.
  Result<VerifyReport> Verify(const VerifyRequest& request, const Patience& patience) const;
  // Drops the keyframes that matter nowhere any more (preset bounded); the tiles stay as they are.
  // kUnavailable while another one is under way, kInvalidData names what is damaged; errors as
  // CheckCompaction and CompactAt. Without success everything is as it was.
  Result<CompactionReport> Compact(const CompactionRequest& request, const Patience& patience);

 private:
  Result<VerifyReport> VerifyInTime(bool rebuild, const Patience& patience) const;
  // Ends with what the store refuses to write where nothing is fused for that: a disk that filled
  // would be waited for without end.
  Result<WaitOutcome> UntilCleanOrFull(const Patience& patience) const;
  // Of an atlas without dirty tiles, nor damage.
  Result<std::uint64_t> CleanRevision(const Patience& patience) const;

  AtlasStore& store_;
  ChangeSignal& changes_;
  const FusionWait& wait_;
  std::mutex compacting_;
};

}  // namespace atlas
