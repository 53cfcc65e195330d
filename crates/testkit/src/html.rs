//! Checks on a page: its tags close, and what its pictures draw is inside them.

/// Fails unless every tag is closed by its own, in order.
pub fn assert_well_formed(page: &str, name: &str) {
    let body = page.split_once("<body>").expect("a body").1;
    let mut open: Vec<&str> = vec!["html", "body"];
    for tag in body.split('<').skip(1) {
        let (tag, text) = tag
            .split_once('>')
            .unwrap_or_else(|| panic!("{name}: a tag without an end: {tag}"));
        assert!(!text.contains('>'), "{name}: a bare > in {text}");
        let word = tag.split([' ', '/']).find(|word| !word.is_empty()).expect("a name");
        if tag.starts_with('/') {
            assert_eq!(open.pop(), Some(word), "{name}");
        } else if !tag.ends_with('/') {
            open.push(word);
        }
    }
    assert!(open.is_empty(), "{name}: left open: {open:?}");
}

/// Fails unless every coordinate of every picture is a number within the picture. Returns the number of pictures.
pub fn assert_drawn_within(page: &str, name: &str) -> usize {
    let mut pictures = 0;
    for picture in page.split("<svg ").skip(1) {
        let (picture, _) = picture.split_once("</svg>").expect("a picture that ends");
        let size: Vec<f64> = numbers(attribute(picture, "viewBox").expect("a view box"));
        let (width, height) = (size[2], size[3]);
        for element in picture.split('<').skip(1) {
            let points = attribute(element, "points").map(numbers).unwrap_or_default();
            let pair = |x: &str, y: &str| {
                [x, y]
                    .map(|axis| attribute(element, axis).map(numbers).unwrap_or_default())
                    .concat()
            };
            for place in [
                points,
                pair("x", "y"),
                pair("cx", "cy"),
                pair("x1", "y1"),
                pair("x2", "y2"),
            ] {
                for point in place.chunks(2) {
                    let inside = point[0] > 0.0 && point[0] < width && point[1] > 0.0 && point[1] < height;
                    assert!(inside, "{name}: {point:?} is not within {width} × {height}: {element}");
                }
            }
            for length in ["width", "height"] {
                let length = attribute(element, length).map(numbers).unwrap_or_default();
                assert!(length.iter().all(|length| *length >= 0.0), "{name}: {element}");
            }
        }
        pictures += 1;
    }
    pictures
}

fn attribute<'a>(element: &'a str, name: &str) -> Option<&'a str> {
    let (_, rest) = element.split_once(&format!(" {name}=\""))?;
    rest.split('"').next()
}

fn numbers(text: &str) -> Vec<f64> {
    let words = text.split([' ', ',']).filter(|word| !word.is_empty());
    words
        .map(|word| word.parse().unwrap_or_else(|_| panic!("{word} in {text} is no number")))
        .collect()
}
