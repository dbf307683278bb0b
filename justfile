# Everything that .ci/run runs
check:
    .ci/run

# The edit loop, without the viewer, which is slow to build: all tests, or those whose name contains ARGS
test *ARGS:
    cargo test --release --no-default-features {{ARGS}}

# Halves and doubles the parameters of the fits, the segmentation and the cut, and lists those that break a goal: about an hour on
# 2 cores. ARGS: --quick (one subject, about five minutes), --only pose.margin,segment.color
sensitivity *ARGS:
    cargo build --release --no-default-features --bin overcoat --example sensitivity
    target/release/examples/sensitivity {{ARGS}}

# The opt-in tests on scans of bodies that Overcoat did not make: OVERCOAT_FOREIGN names their folder
foreign:
    : "${OVERCOAT_FOREIGN:?must name the folder of the foreign scans}"
    cargo test --release --no-default-features --test integration -- foreign --ignored --nocapture

# The hashes that tests/stage_versions.rs compares each stage's outputs with; refuses where a version must be
# bumped first
stage-hashes:
    OVERCOAT_REFRESH_STAGE_HASHES=1 cargo test --release --no-default-features --test integration -- stage_versions --nocapture

# The pictures of the README, from the demo
pictures:
    rm -rf target/pictures
    cargo run --release --no-default-features -- body show --sheet .pictures/body.png --force
    cargo run --release --no-default-features -- demo --keep target/pictures
    cp target/pictures/poster.png .pictures/poster.png
    cp target/pictures/sheet.png .pictures/sheet.png
    cargo run --release --no-default-features -- -C target/pictures/session animate walk --frames 60..93 --mode coupled
    cargo run --release --no-default-features -- -C target/pictures/session view --film .pictures/walk.gif --force

# The embedded body model, from measured populations
body-model:
    cargo run --release --no-default-features --example build_body_model -- templates/body/adult.npz

# Its garments differ from those in the repository, which are of earlier fabrics.
# The scans of the demo and their truth, generated again from the body model; the brush files stay
demo-scans:
    rm -rf target/demo-scans scans/demo/*.ply scans/demo/*.jpg scans/demo/truth
    cargo run --release --no-default-features -- studio make --seed 6 --garments tshirt,skirt,pullover,vest --faces 55000 --no-frames --texture 2048 --out target/demo-scans
    cp -r target/demo-scans/* scans/demo/

# Registration of the body model to bare bodies: distance, inverted and intersecting faces, processor time. FILES are scans
# (SCAN.ply=TRUTH.ply where the truth is known) or an .npz with vertices (N,V,3) and faces (F,3)
registration +FILES:
    cargo run --release --no-default-features --example measure_registration -- {{FILES}}

# The fits on 20 synthetic people: naked, tight, wide, wrong arms, any heading;
# beside the paper's methods and three ablations. FOLDER keeps the scans, so a second run takes 4 minutes instead of 20
# on 2 cores. ARGS: --seeds-from HASH for fresh people (without it their seeds are spent, see
# docs/evaluation.md), --subjects N, --parts naked,tight,loose,arms, --keep DIR
fit-table FOLDER="target/judged" *ARGS:
    cargo run --release --no-default-features --example measure_fit -- {{FOLDER}} {{ARGS}}

# Garments and layers on 30 synthetic outfits of four or five layers, half of them from RGB-D frames: verdicts, labels, hems, crossings.
# FOLDER keeps the scans, which take an hour on 2 cores. ARGS: --seeds-from HASH for fresh people, --outfits 0..30, --jobs 2
outfits FOLDER="target/outfits" *ARGS:
    cargo build --release --no-default-features --bin overcoat --example measure_outfits
    target/release/examples/measure_outfits {{FOLDER}} {{ARGS}}

# Ten people in each of eleven difficult kinds of garment: how many are right. ARGS as for `outfits`
kinds FOLDER="target/kinds" *ARGS:
    cargo build --release --no-default-features --bin overcoat --example measure_outfits
    target/release/examples/measure_outfits {{FOLDER}} --kinds {{ARGS}}

# Only whether naked fits converge from any heading and from arms held 30 degrees wrong
fit-convergence FOLDER="target/judged":
    cargo run --release --no-default-features --example measure_fit -- {{FOLDER}} --parts arms

# The body from its naked scan alone beside one shape from three scans, also where the naked scan lacks an arm or has holes
fit-shape FOLDER="target/judged" *ARGS:
    cargo run --release --no-default-features --example measure_fit -- {{FOLDER}} --parts shape {{ARGS}}

# Unusable scans: hands on hips, crossed arms, seated, missing parts, two people, a child, a held box, another person; naked and
# dressed. Each must be solved as far as it shows the person, or refused
fit-bad FOLDER="target/judged" *ARGS:
    cargo run --release --no-default-features --example measure_fit -- {{FOLDER}} --parts bad --subjects 4 {{ARGS}}

# Checks the figure of the session in FOLDER with an independent library: that no layer crosses itself or another layer; needs
# Python with numpy and ipctk, and stops with a message without them
certify FOLDER:
    cargo build --release --no-default-features --bin overcoat
    mkdir -p target/certify
    target/release/overcoat -C {{FOLDER}} export target/certify/figure.glb --force
    python3 benches/peers/certify.py target/certify/figure.glb

# The demo's layers as quads, twice: equal bytes, pairs of triangles, all attributes
quads:
    cargo test --release --no-default-features --test integration -- --ignored --nocapture a_glb_of_quads

# The figure of the session in FOLDER as USD, opened in OpenUSD with all its validators, and skinned by it; needs Python with usd-core
# and numpy
check-usd FOLDER:
    cargo build --release --no-default-features --bin overcoat
    mkdir -p target/usd
    for kind in usda usdc usdz; do target/release/overcoat -C {{FOLDER}} export target/usd/figure.$kind --force; done
    python3 benches/peers/usd.py target/usd/figure.usda target/usd/figure.usdc target/usd/figure.usdz

# The figure of the session in FOLDER as VRM, opened in three-vrm; needs Chromium and Node.js, and installs its packages in target/vrm
check-vrm FOLDER:
    cargo build --release --no-default-features --bin overcoat
    mkdir -p target/vrm
    target/release/overcoat -C {{FOLDER}} export target/vrm/figure.vrm --force
    cd target/vrm && npm install --silent three @pixiv/three-vrm playwright-core gltf-validator
    cd target/vrm && node ../../benches/peers/vrm.mjs figure.vrm picture.png

# The figure of the session in FOLDER in Blender: cloth modifiers and pin groups by the script of the export, and an FBX.
# Debian's Blender 3.4 expects an older numpy than Debian's
check-blender FOLDER:
    cargo build --release --no-default-features --bin overcoat
    mkdir -p target/blender
    target/release/overcoat -C {{FOLDER}} export target/blender/figure.glb --for blender --force
    blender --background --python-exit-code 1 --python-expr 'import numpy; numpy.bool = bool' --python target/blender/figure.blender.py -- --fbx target/blender/figure.fbx

# The figure of the session in FOLDER, imported by Debian's godot3-server
check-godot FOLDER:
    cargo build --release --no-default-features --bin overcoat
    rm -rf target/godot && mkdir -p target/godot
    target/release/overcoat -C {{FOLDER}} export target/godot/figure.glb --force
    printf 'config_version=4\n[application]\nconfig/name="check"\n' > target/godot/project.godot
    godot3-server --editor --quit --path target/godot
    godot3-server --path target/godot -s $PWD/benches/peers/godot.gd

# Whether synthetic scans are as hard as foreign ones, and trivial methods fail on them
realism:
    cargo test --release --no-default-features --test integration -- realism:: --nocapture

# A session killed 1000 times at random moments: it opens each time and ends with the bytes of a session never killed
kills:
    cargo test --release --no-default-features --test integration -- --ignored --nocapture a_thousand_kills

# A disk that is full at every moment of the work; mounts a small one, so it needs root
disk-full:
    cargo test --release --no-default-features --test integration -- --ignored --nocapture a_full_disk

# Time of the kernels, or of those whose name contains ARGS
bench *ARGS:
    cargo bench --no-default-features --bench kernels -- {{ARGS}}

# The kernels beside Open3D, libigl, PyMaxflow, cholespy and SciPy on the same input, as ratios; needs Python with numpy, and skips
# the packages that are missing
bench-peers-kernels:
    cargo build --release --no-default-features --example time_kernels
    python3 benches/peers/kernels.py target/release/examples/time_kernels

# Verdicts on 24 graded garments, and on four trousers as in Shi 2020, against truth from geometry; needs Python with numpy, and
# takes the man and the woman of the folder OVERCOAT_FOREIGN too
sizes-table FOLDER="target/sizes":
    cargo build --release --no-default-features --bin overcoat
    python3 benches/sizes.py target/release/overcoat {{FOLDER}}

# Time and peak memory of a scan of 20 million triangles, 1000 frames, 8 garments, 300 frames of cloth, or of the CASES named; needs
# Python with numpy, 3 GB and a quarter of an hour
limits *CASES:
    cargo build --release --no-default-features --bin overcoat
    python3 benches/limits.py target/release/overcoat scans/demo target/limits {{CASES}}

# Fusion beside Open3D on the same frames, as ratios: FOLDER is a recording with groundtruth.txt; needs Python with open3d and
# numpy, and stops with a message without them. Open3D is given the true poses
bench-peers FOLDER:
    cargo build --release --no-default-features --example measure_fusion
    python3 benches/peers/fusion.py target/release/examples/measure_fusion {{FOLDER}}

# The studio's own fusion of a synthetic body, with the true poses, beside that of `scan`, which finds the poses in the same
# frames: distances from the truth. FOLDER keeps the body
studio-fusion FOLDER="target/studio-fusion":
    cargo build --release --no-default-features --bin overcoat --example measure_fusion
    test -d {{FOLDER}} || target/release/overcoat studio make --seed 7 --garments tshirt --out {{FOLDER}}
    target/release/examples/measure_fusion --mesh {{FOLDER}}/0-body.ply --truth {{FOLDER}}/truth/0_body.ply
    target/release/examples/measure_fusion {{FOLDER}}/0-body --truth {{FOLDER}}/truth/0_body.ply

# The naked fit beside PyTorch on the same body and points, as ratios: FOLDER holds body10k.npz and body10k_skin.npz, see the
# head of the script; needs Python with torch, scipy and numpy, and stops with a message without them
bench-peers-fit FOLDER:
    cargo build --release --no-default-features --example time_fit
    python3 benches/peers/fit.py target/release/examples/time_fit {{FOLDER}}

# Garments on the figure of a session, and the steps of Shi 2020 beside its Table 1
tryon-table SESSION *FILES:
    cargo run --release --no-default-features --example measure_tryon -- {{SESSION}} {{FILES}}

# Bodies from photos: reprojection, joints, height; beside the mean body turned rigidly and the same solver without depth flips. FOLDER
# holds keypoints, cameras and truth; ARGS: --fresh N synthetic people, --seed S
photo-table FOLDER *ARGS:
    cargo run --release --no-default-features --example measure_photo -- {{FOLDER}} {{ARGS}}

# The tables of `drive`. MAN and WOMAN are sessions, STREAMS holds folders of streams with truth, CLIPS are .bvh files
drive-table MAN WOMAN STREAMS *CLIPS:
    cargo build --release --no-default-features --example measure_drive
    target/release/examples/measure_drive streams {{MAN}}={{STREAMS}}/man_clean {{WOMAN}}={{STREAMS}}/other_person {{MAN}}={{STREAMS}}/man_noisy
    target/release/examples/measure_drive speed {{MAN}}
    target/release/examples/measure_drive trackers {{MAN}}
    target/release/examples/measure_drive keys {{MAN}}
    target/release/examples/measure_drive classes docs/drive {{MAN}} {{WOMAN}} {{CLIPS}}

# 100 000 changed copies of small valid files, for each reader, in at most 4 GB: no panic, no hang
mutations:
    cargo test --release --no-default-features --test integration --no-run
    ulimit -v 4000000; OVERCOAT_MUTATIONS=100000 cargo test --release --no-default-features --test integration -- mutations::

# Cloth in motion on the figures of built sessions: time of a frame, crossings, stretch, rest. SESSIONS: SESSION[:LAYER=FABRIC,…];
# ARGS: --clips walk,turn --frames A..B --draft
cloth-table *ARGS:
    cargo run --release --no-default-features --example measure_cloth -- {{ARGS}}

# A garment held by its first PINNED vertices on a body that turns to and fro, to be timed beside other programs
time-cloth BODY GARMENT PINNED *ARGS:
    cargo run --release --no-default-features --example time_cloth -- {{BODY}} {{GARMENT}} {{PINNED}} {{ARGS}}

# Ten thousand frames of cloth: nothing crosses, nothing explodes
cloth-long:
    cargo test --release --no-default-features --lib -- --ignored --nocapture ten_thousand_frames

# Whether the types of the pages' scripts agree; needs npm
desk-types:
    npm install --silent --no-save --prefix target/desk typescript
    target/desk/node_modules/.bin/tsc --noEmit --allowJs --checkJs --strict --target es2022 --module es2022 --moduleResolution bundler --lib es2022,dom,dom.iterable src/desk/pages/*.js

# Paints the built session SESSION in headless Chromium, by mouse and keys: files, labels, undo, a second page, a killed server, the
# console, accessibility (axe). OUT receives pictures. Needs chromium (CHROMIUM names another one) and npm
desk SESSION OUT:
    cargo build --release --no-default-features --bin overcoat
    npm install --silent --no-save --prefix target/desk playwright-core axe-core
    node tests/desk/surface.mjs src/desk/pages
    node tests/desk/paint.mjs target/release/overcoat {{SESSION}} {{OUT}} target/desk

# Dresses 8 synthetic people with Snakemake on this machine, with one job killed and one scan damaged, beside `replay --subjects`
batch-example *ARGS="--cores 2":
    cargo build --release --no-default-features --bin overcoat
    examples/batch/example.sh target/release/overcoat target/batch {{ARGS}}

# The same through Slurm on this machine; needs snakemake-executor-plugin-slurm and a running Slurm
batch-slurm *ARGS:
    cargo build --release --no-default-features --bin overcoat
    examples/batch/example.sh target/release/overcoat target/batch-slurm --executor slurm --jobs 8 --slurm-no-account --slurm-status-command squeue {{ARGS}}

# The body under clothes without a bare scan: hidden body, bias, girths in their intervals. FOLDER keeps synthetic people; PEOPLE are
# seeds, or SCAN:BODY:LAYER,LAYER:KIND,KIND of files with truth, scans of one person joined by +; flags: --no-contact, --known-body,
# --mean-body, --weak-prior
estimated-table FOLDER="target/estimated" *PEOPLE:
    cargo run --release --no-default-features --example measure_estimated -- fit {{FOLDER}} {{PEOPLE}}

# templates/contact.toml, from synthetic people of these seeds
contact-table FOLDER="target/estimated" *SEEDS:
    cargo run --release --no-default-features --example measure_estimated -- contact {{FOLDER}} {{SEEDS}}
