//! CT to labels: body, lungs, bones, chest wall and soft tissue.
