#include "client/atlas_file/backup_restore.h"

#include <utility>

#include "core/tile/tile_codec.h"
#include "server/store/sqlite/restore.h"

namespace atlas {

Result<RestoreSummary> RestoreBackup(const RestorePlan& plan) {
  RestoreOrder order{plan.backup, plan.target, plan.replaces, {}};
  order.work.payload_of = TilePayloadFromBlob;
  order.work.check_stop = plan.check_stop;
  order.work.on_progress = [&plan](const BackupProgress& progress) {
    plan.on_progress(progress.done_bytes, progress.total_bytes);
  };
  const Result<RestoredAtlas> done = RestoreAtlas(order);
  if (!done) return Error(done.error());
  const AtlasFacts& backup = done->backup;
  return RestoreSummary{backup.revision,
                        backup.keyframes,
                        backup.tiles,
                        backup.bytes,
                        Bytes(backup.sha256.begin(), backup.sha256.end()),
                        done->epoch,
                        done->revision,
                        done->kept,
                        done->left};
}

}  // namespace atlas
