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
    cargo run --release --no-default-features -- demo --keep target/pictures
    cargo build --release --no-default-features --example render_mesh
    target/release/examples/render_mesh scans/demo/0-body.ply --paint rgb --views front --size 300x520 -o .pictures/scan-body.png
    target/release/examples/render_mesh scans/demo/1-tshirt.ply --paint rgb --views front --size 300x520 -o .pictures/scan-tshirt.png
    target/release/examples/render_mesh scans/demo/2-skirt.ply --paint rgb --views front --size 300x520 -o .pictures/scan-skirt.png
    cd target/pictures/layers && ../../release/examples/render_mesh body.ply tshirt.ply skirt.ply --views three-quarter --size 300x520 -o ../../../.pictures/layers.png
    cd target/pictures/layers && ../../release/examples/render_mesh body.ply tshirt.ply skirt.ply --paint rgb --views three-quarter --size 300x520 -o ../../../.pictures/character.png

# The embedded body model, from measured populations
body-model:
    cargo run --release --no-default-features --example build_body_model -- templates/body/adult.npz

# The demo's scans and their truth, invented anew from the body model
demo-scans:
    cargo run --release --no-default-features --example make_demo_scans -- scans/demo

# A session killed 300 times at random moments: each time it opens, and it ends with the bytes of one never killed
kills:
    cargo test --release --no-default-features --test durability -- --ignored --nocapture three_hundred_kills

# A disk that is full at every moment of the work; mounts a small one, so it needs root
disk-full:
    cargo test --release --no-default-features --test durability -- --ignored --nocapture a_full_disk
