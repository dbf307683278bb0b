# Everything that .ci/run asks for
check:
    .ci/run

# The edit loop: without the viewer, which takes long to build
test *ARGS:
    cargo test --release --no-default-features {{ARGS}}

# The opt-in tests, on scans of bodies that Overcoat did not make: OVERCOAT_FOREIGN names their folder
foreign:
    : "${OVERCOAT_FOREIGN:?name the folder of the foreign scans}"
    cargo test --release --no-default-features --test foreign_segment -- --ignored --nocapture

# The README's pictures, from the demo
pictures:
    rm -rf target/pictures
    cargo run --release --no-default-features -- body show --sheet .pictures/body.png
    cargo run --release --no-default-features -- demo --keep target/pictures
    cp target/pictures/poster.png .pictures/poster.png
    cp target/pictures/sheet.png .pictures/sheet.png

# The embedded body model, from measured populations
body-model:
    cargo run --release --no-default-features --example build_body_model -- templates/body/adult.npz

# The demo's scans and their truth, invented anew from the body model; the brush files stay
demo-scans:
    rm -rf target/demo-scans scans/demo/*.ply scans/demo/truth
    cargo run --release --no-default-features -- studio make --seed 6 --garments tshirt,skirt,pullover,vest --faces 55000 --no-frames --out target/demo-scans
    cp -r target/demo-scans/* scans/demo/

# Registration of the body model to bare bodies: distance, faces turned over or crossing, processor time. FILES are scans
# (SCAN.ply=TRUTH.ply where the truth is known) or an .npz with vertices (N,V,3) and faces (F,3)
registration +FILES:
    cargo run --release --no-default-features --example measure_registration -- {{FILES}}

# The fits on 20 invented people whom nothing was tuned on: naked, close, wide, arms held wrong, any heading; beside the
# paper's way, no constraint, and two wrong figures. FOLDER keeps the scans, so that a second run only fits, in 4 minutes instead of 20
# on 2 cores. ARGS: --subjects N, --parts naked,tight,loose,arms, --keep DIR
fit-table FOLDER="target/judged" *ARGS:
    cargo run --release --no-default-features --example measure_fit -- {{FOLDER}} {{ARGS}}

# Only whether naked fits converge from any heading and from 30 degrees of wrong arm spread
fit-convergence FOLDER="target/judged":
    cargo run --release --no-default-features --example measure_fit -- {{FOLDER}} --parts arms

# The body by its naked scan alone beside one shape from three scans, also where the naked scan lacks an arm or has holes
fit-shape FOLDER="target/judged" *ARGS:
    cargo run --release --no-default-features --example measure_fit -- {{FOLDER}} --parts shape {{ARGS}}

# What is no good scan: hands on hips, arms crossed, seated, parts missing, two people, a child, a box held, another person;
# naked and dressed. Each must be solved as far as it is seen, or refused
fit-bad FOLDER="target/judged" *ARGS:
    cargo run --release --no-default-features --example measure_fit -- {{FOLDER}} --parts bad --subjects 4 {{ARGS}}

# Whether what the studio invents is as hard as foreign scans, and easy answers fail on it
realism:
    cargo test --release --no-default-features --test realism -- --nocapture

# A session killed 300 times at random moments: each time it opens, and it ends with the bytes of one never killed
kills:
    cargo test --release --no-default-features --test durability -- --ignored --nocapture three_hundred_kills

# A disk that is full at every moment of the work; mounts a small one, so it needs root
disk-full:
    cargo test --release --no-default-features --test durability -- --ignored --nocapture a_full_disk

# Fusion beside Open3D on the same frames, as ratios: FOLDER is a recording with groundtruth.txt; needs Python with
# open3d and numpy, and says so where they are not; Open3D runs on the very frames, given their true poses
bench-peers FOLDER:
    cargo build --release --no-default-features --example measure_fusion
    python3 benches/peers/fusion.py target/release/examples/measure_fusion {{FOLDER}}

# The naked fit beside PyTorch on the same body and points, as ratios: FOLDER holds body10k.npz and body10k_skin.npz, see
# the head of the script; needs Python with torch, scipy and numpy, and says so where they are not
bench-peers-fit FOLDER:
    cargo build --release --no-default-features --example time_fit
    python3 benches/peers/fit.py target/release/examples/time_fit {{FOLDER}}
