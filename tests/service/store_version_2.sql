-- Dump of a store of version 2, as of postchain 0.2.0: the job of version 1, and one whose process died
-- while its second frame was in flight.
BEGIN TRANSACTION;
CREATE TABLE events(
  id INTEGER PRIMARY KEY AUTOINCREMENT, job INTEGER NOT NULL REFERENCES jobs(id) ON DELETE CASCADE,
  time_ms INTEGER NOT NULL, type TEXT NOT NULL, data TEXT NOT NULL);
INSERT INTO "events" VALUES(1,1,1795325943920,'queued','{"kind":"run","priority":0}');
INSERT INTO "events" VALUES(2,1,1795325943929,'started','{}');
INSERT INTO "events" VALUES(3,1,1795325943934,'frames','{"frames":2}');
INSERT INTO "events" VALUES(4,1,1795325944345,'frame','{"frame":1,"state":"written","filter_ms":345.410843,"frames":2,"done":1,"failed":0}');
INSERT INTO "events" VALUES(5,1,1795325944346,'frame_failed','{"frame":2,"attempts":1,"message":"shots/sharp.0002.exr: truncated: the file ends inside its header; copy or render it again"}');
INSERT INTO "events" VALUES(6,1,1795325944353,'frame_failed','{"frame":2,"attempts":2,"message":"shots/sharp.0002.exr: truncated: the file ends inside its header; copy or render it again"}');
INSERT INTO "events" VALUES(7,1,1795325944365,'quarantined','{"frame":2,"attempts":3,"message":"shots/sharp.0002.exr: truncated: the file ends inside its header; copy or render it again"}');
INSERT INTO "events" VALUES(8,1,1795325944373,'failed','{"exit_code":1,"message":"1 of 2 frames set aside: 2"}');
INSERT INTO "events" VALUES(9,2,1795325953920,'queued','{"kind":"run","priority":5}');
INSERT INTO "events" VALUES(10,2,1795325953929,'started','{}');
INSERT INTO "events" VALUES(11,2,1795325953934,'frames','{"frames":2}');
INSERT INTO "events" VALUES(12,2,1795325954345,'frame','{"frame":1,"state":"written","filter_ms":345.5,"frames":2,"done":1,"failed":0}');
CREATE TABLE frames(
  job INTEGER NOT NULL REFERENCES jobs(id) ON DELETE CASCADE, place INTEGER NOT NULL,
  frame INTEGER NOT NULL, state TEXT NOT NULL, attempts INTEGER NOT NULL DEFAULT 0,
  begun INTEGER NOT NULL DEFAULT 0, in_flight INTEGER NOT NULL DEFAULT 0,
  alone INTEGER NOT NULL DEFAULT 0, held INTEGER NOT NULL DEFAULT 0, output TEXT NOT NULL, message TEXT NOT NULL DEFAULT '',
  filter_ms REAL NOT NULL DEFAULT 0, sidecar TEXT NOT NULL DEFAULT '',
  PRIMARY KEY(job, frame)) WITHOUT ROWID;
INSERT INTO "frames" VALUES(1,0,1,'written',1,1,0,0,0,'/srv/out/o.0001.exr','',345.5,'{"a": 1}');
INSERT INTO "frames" VALUES(1,1,2,'quarantined',3,1,0,0,0,'/srv/out/o.0002.exr','shots/sharp.0002.exr: truncated: the file ends inside its header; copy or render it again',0.0,'');
INSERT INTO "frames" VALUES(2,0,1,'written',1,1,0,0,0,'/srv/out/p.0001.exr','',345.5,'{"a": 1}');
INSERT INTO "frames" VALUES(2,1,2,'waiting',1,1,1,0,0,'/srv/out/p.0002.exr','',0.0,'');
CREATE TABLE jobs(
  id INTEGER PRIMARY KEY AUTOINCREMENT, kind TEXT NOT NULL, state TEXT NOT NULL,
  priority INTEGER NOT NULL, body TEXT NOT NULL, key TEXT NOT NULL, message TEXT NOT NULL DEFAULT '',
  created_ms INTEGER NOT NULL, started_ms INTEGER NOT NULL DEFAULT 0,
  ended_ms INTEGER NOT NULL DEFAULT 0, frames INTEGER NOT NULL DEFAULT 0,
  done INTEGER NOT NULL DEFAULT 0, failed INTEGER NOT NULL DEFAULT 0,
  exit_code INTEGER NOT NULL DEFAULT 0, verdict TEXT NOT NULL DEFAULT '',
  begun INTEGER NOT NULL DEFAULT 0, attempts INTEGER NOT NULL DEFAULT 0);
INSERT INTO "jobs" VALUES(1,'run','failed',0,'{"chain":"fast","input":"shots/sharp.####.exr","camera":"shots/camera.json","output":"out/o.####.exr","sidecar":true}','','1 of 2 frames set aside: 2',1795325943920,1795325943929,1795325944373,2,1,1,1,'',1,0);
INSERT INTO "jobs" VALUES(2,'run','running',5,'{"chain":"fast","input":"shots/sharp.####.exr","output":"out/p.####.exr"}','key','',1795325953920,1795325953929,0,2,1,0,0,'',1,0);
CREATE UNIQUE INDEX jobs_key ON jobs(key) WHERE key <> '';
CREATE INDEX jobs_queue ON jobs(state, priority DESC, id);
CREATE INDEX events_job ON events(job, id);
DELETE FROM "sqlite_sequence";
INSERT INTO "sqlite_sequence" VALUES('jobs',2);
INSERT INTO "sqlite_sequence" VALUES('events',12);
COMMIT;
PRAGMA application_id = 1885555283;
PRAGMA user_version = 2;
